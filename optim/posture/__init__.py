"""Criteria and methods by name, with a few words for each: known without JAX and any solver."""

from stickslip.optim import GENERAL_METHODS

CRITERIA_IN_WORDS: dict[str, str] = {
    "wheel_energy": (
        "work that the wheels' motors put in, none recovered; trapezoid rule over each step"
    ),
    "total_energy": (
        "the same with both leg actuators: positive work of the motors and of each actuator"
    ),
    "peak_torque": "largest |M| of all stations",
    "torque_variation": (
        "most constant torque: the integral of (dM/dx)^2, M straight between stations"
    ),
    "grip": "minus the least mu N - |F| of both wheels",
    "normal_force": "minus the least normal force",
    "friction_demand": "largest |F| / N of both wheels",
}
"""The names of stickslip.optim.CRITERIA, in its order, with their descriptions."""

METHODS: dict[str, str] = {
    "grid": "every pair of angles at each waypoint, the best one chosen point by point",
    "dp": "dynamic programming over the grid: the best path of all, proved",
    "branch": "dp and scp, and branch and bound over cells of angles: what no drive can beat",
    "scp": "sequential convex programming in cvxpy, from a feasible path",
    **GENERAL_METHODS,
}
"""The methods of a posture problem; `methods_of` tells those of any problem."""

TREATMENTS: dict[str, str] = {
    "outliers": (
        "points further in height from the median of two neighbours on each side are dropped"
    ),
    "merge": (
        "points are sorted by x (of a GPX track they stay in their order), and neighbours within "
        "this distance become one at their mean; 0: points at one place"
    ),
    "gaps": "longer gaps are filled with points on a straight line",
    "noise": "the smoothest curve that misses the points by this root mean square",
    "smooth": "instead: this wavelength is halved, shorter ones are damped more",
    "envelope": (
        "hollows that a disc of this radius cannot enter are filled up to it (default of a "
        "command: 1.1 wheel radii)"
    ),
}
"""Treatments of a survey by name, each a length [m], in the order in which they are applied."""
