"""Gaits of the biped that are best of all that do not slip: convex programs, with their proofs.

`problem.py` states the problem, `gait.py` holds a gait and the result, `replay.py` walks a gait in
simulation; `convex/` solves and proves. `slip_transfer.py` searches walks whose foot may slip, by
dynamic programming over the motion in `sliding.py`.
"""

OBJECTIVES: dict[str, str] = {
    "time": "least time: the fastest gait [s]",
    "torque": "torque squared over time, what the windings heat by [(N m)^2 s]",
    "work": "positive work of the motor, none recovered [J]",
    "energy": "positive work plus copper_loss x torque squared over time [J]",
    "friction": "largest |friction| / normal force, the least static friction that will do [-]",
}
"""Objectives by name. A weighted sum maps names, friction left out, to weights."""

METHODS = {"conic": "second-order cones in cvxpy, proved by duality outside of the solver"}
