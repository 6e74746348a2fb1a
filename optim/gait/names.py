"""Objectives of gaits by name, with a few words for each: known without JAX and any solver."""

OBJECTIVES: dict[str, str] = {
    "time": "least time: the fastest gait [s]",
    "torque": "torque squared over time, what the windings heat by [(N m)^2 s]",
    "torque_over_phase": "torque squared over the crank angle [(N m)^2 rad]",
    "work": "positive work of the motor, none recovered [J]",
    "energy": "positive work plus copper_loss x torque squared over time [J]",
    "friction": "largest |friction| / normal force, the least static friction that will do [-]",
}
"""Names of objectives. A weighted sum maps names, friction left out, to weights."""

METHODS: dict[str, str] = {
    "conic": "second-order cones in cvxpy, proved by duality outside of the solver",
}
