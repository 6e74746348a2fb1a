"""Names that the flags know and what each means: known without JAX."""

SETTINGS = {
    "fast": "a table and steps of 5 ms in single precision",
    "balanced": "a table and steps of 2.5 ms in single precision",
    "exact": "every switch located by an adaptive method in double precision",
}
"""Of stickslip.dynamics.PRESETS."""
FIDELITIES = {
    "joint": "the 72 equations of all bodies, solved at every call",
    "reduced": "exact inertia functions, by differentiating the closed linkage",
    "table": "polynomials fitted to the exact ones, piece by piece",
    "chebyshev": "one series over the support phase",
    "paper": "the chapter's: forward differences in the crank angle",
}
INTEGRATORS = {
    "euler": "the chapter's: accelerations constant during a step",
    "semi_implicit": "velocities first, positions with the new ones",
    "rk4": "Runge-Kutta in one mode a step",
    "rk4_split": "the same, split at every switching instant",
    "event_exact": "adaptive, every switching instant located to the tolerance",
}
DTYPES = ("float32", "float64")
"""Of stickslip.dynamics.biped: FIDELITIES, INTEGRATORS."""
STATUS = {
    "OK": "the whole time was walked",
    "SLIP_ONSET": "the whole time was walked; the foot slipped",
    "TOPPLE": "it falls: the zero-moment point leaves the foot",
    "LIFT_OFF": "it falls: the ground would have to pull at the foot",
    "RUNAWAY": "the crank turns faster than the greatest rate that was given",
    "NO_SOLUTION": "the equations have no unique solution here (Painlevé), or the linkage does not "
    "close",
    "NON_FINITE": "a number overflowed or is none, the torque's perhaps",
    "STEP_COMPLETE": "the one step was walked to the exchange of support",
    "NO_EXCHANGE": "support cannot be handed over without an impact",
    "NOT_CONVERGED": "the integrator's steps are too few or too long; the numbers end there",
    "HOLLOW_GROUND": "the ground is hollower than a wheel",
    "ROLLOVER": "it rolls over: the ground would have to pull at a wheel",
    "GROUNDED": "the body or a leg touches the ground",
    "WHEEL_SLIP": "a wheel slips: it needs more friction than there is",
    "OVERLOAD": "a wheel needs more torque than its motor gives",
    "OVERLAP": "the wheels overlap: the legs are folded too far",
}
"""Meaning of each Status for a simulation."""
FALLS = ("TOPPLE", "LIFT_OFF")
WHOLE = ("OK", "SLIP_ONSET", "STEP_COMPLETE")
"""Statuses of a walk that came to the end of what was asked."""
