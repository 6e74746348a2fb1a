"""A solved posture problem in words, as a table of stations and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.status import Status
from stickslip.optim import PostureProblem, PostureResult
from stickslip.optim.posture.evaluate import tolerated
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim import Station

ENERGIES = {
    "wheel_energy": "work of the wheels' motors",
    "total_energy": "the same with the legs' actuators",
}
"""Positive work only, none recovered. The first alone says little: legs that lift the vehicle
spare its wheels."""
STATIONS = "stations.csv"
FRONT_WHEEL, REAR_LEG, FRONT_LEG = "front wheel", "rear leg angle", "front leg angle"
"""Columns of a drive that say what it is; all others follow from them."""
NOTABLE = 0.05
"""Relative difference of the value between waypoints above which there is a warning."""
UNITS = {
    "leg_range": "rad",
    "start_angles": "rad",
    "end_angles": "rad",
    "leg_rate": "rad/m",
    "grip": "N",
    "normal": "N",
    "clearance": "m",
    "wheels": "m",
    "torque": "N m",
    "pose": "waypoints",
}
"""Of PostureProblem.residuals."""
STATED = ("friction", "leg_rate", "min_normal", "min_grip", "min_clearance", "max_torque")
STATED += ("start_angles", "end_angles", "x")
"""Numbers of a problem that result.json holds."""


def energies(problem: PostureProblem, x: Float[np.ndarray, "n"] | None) -> dict[str, float]:
    """A drive's two energies by the criteria's names [J]; none without a drive."""
    if x is None:
        return {}
    return {name: replace(problem, criterion=name).objective(x) for name in ENERGIES}


def rows(
    problem: PostureProblem, result: PostureResult, spent: Mapping[str, float]
) -> list[tuple[str, str]]:
    """Rows of the printed report: a name and its value. spent: `energies`."""
    unit = "" if problem.criterion.unit == "-" else f" {problem.criterion.unit}"
    x = problem.x
    places = f"{np.max(np.diff(x)):.3g} m apart, from {x[0]:.4g} to {x[-1]:.4g} m"
    bound = result.lower_bound
    found = [
        ("criterion", f"{problem.criterion.name}: {getattr(problem.criterion, 'about', '')}"),
        ("waypoints", f"{len(x)}, {places}"),
        ("status", result.status_in_words),
        ("message", "" if result.message == result.status.value else result.message),
        ("grid", _grid(result, unit)),
        ("value", f"{result.value:.8g}{unit}" if result.x is not None else "no drive found"),
        ("lower bound", "none proved: see branch" if bound is None else f"{bound:.8g}{unit}"),
    ]
    if result.x is not None:
        between = f"{result.fine_value:.8g}{unit} ({result.discretisation:+.1%})"
        between += f", at every {result.fine_spacing:.3g} m, legs moving evenly; violated: "
        found += [
            ("between waypoints", between + _violated(problem, result.fine_residuals)),
            ("feasible", "yes" if result.feasible else "no"),
            ("violated", _violated(problem, result.residuals)),
        ]
    found += [(ENERGIES[name], f"{joules:.6g} J") for name, joules in spent.items()]
    return [
        *found,
        ("evaluations", str(result.evaluations)),
        ("time", f"{result.seconds:.3g} s, compilation included"),
    ]


def warnings(problem: PostureProblem, result: PostureResult) -> list[str]:
    """Sentences on a drive that is not what its value says between its waypoints."""
    said = []
    if abs(result.discretisation) > NOTABLE:
        said.append(f"between the waypoints the value is {result.discretisation:+.1%} off")
    if result.feasible and not result.fine_feasible:
        violated = _violated(problem, result.fine_residuals)
        said.append(f"between the waypoints the drive breaks a constraint: {violated}")
    return [f"{one}; take a smaller spacing" for one in said]


def _grid(result: PostureResult, unit: str) -> str:
    """The grid that was searched, the value of its own path, and the bound over the grid."""
    details = result.details
    if "grid" not in details:
        return ""
    rear, front = details["grid"]
    text = f"{rear} x {front} leg angles, using {min(details['rate_used']):.0%} of the leg rate"
    if "grid_value" in details:
        text += f"; its path {details['grid_value']:.8g}{unit}"
    if details.get("grid_bound") is not None:
        text += f"; no path over it is below {details['grid_bound']:.8g}{unit}"
    return text


def _violated(problem: PostureProblem, residuals: Mapping[str, float]) -> str:
    """Violations beyond the tolerance of feasibility."""
    worst = {name: by for name, by in residuals.items() if by > tolerated(problem, name)}
    return ", ".join(f"{name} {by:.3g} {UNITS[name]}" for name, by in worst.items()) or "nothing"


def table(lines: list[tuple[str, str]]) -> str:
    """Rows for a terminal, the names aligned."""
    columns = [Column("name", words=True), Column("value", words=True)]
    return Table(columns, [line for line in lines if line[1]]).terminal(head=False)


def stations_table(found: Station) -> Table:
    """A row a waypoint, numbers in SI units and radians, every digit."""
    columns: dict[Column, object] = {
        Column(FRONT_WHEEL, "m"): found.x,
        Column(REAR_LEG, "rad"): found.leg_angles[:, 0],
        Column(FRONT_LEG, "rad"): found.leg_angles[:, 1],
        Column("torque on each wheel", "N m"): found.torque,
        Column("turn of both wheels", "rad"): found.turn,
        Column("rear leg torque", "N m"): found.leg_torques[:, 0],
        Column("front leg torque", "N m"): found.leg_torques[:, 1],
        Column("F_rear", "N"): found.F_rear,
        Column("N_rear", "N"): found.N_rear,
        Column("F_front", "N"): found.F_front,
        Column("N_front", "N"): found.N_front,
        Column("least grip margin", "N"): found.grip,
        Column("clearance", "m"): found.clearance,
        Column("between the wheels", "m"): found.wheel_clearance,
    }
    numbers = [np.asarray(values, float).tolist() for values in columns.values()]
    status = [Status(int(code)).name for code in np.asarray(found.status)]
    head = [*columns, Column("status", words=True)]
    return Table(head, list(zip(*numbers, status, strict=True)))


def result_content(
    problem: PostureProblem,
    result: PostureResult,
    spent: Mapping[str, float],
    asked: Mapping[str, Any],
) -> dict[str, object]:
    """Everything: what was asked for, the problem's numbers, the result."""
    stated = {name: getattr(problem, name) for name in STATED}
    stated |= {"criterion": problem.criterion.name, "unit": problem.criterion.unit}
    stated |= {"overlap": problem.solver.overlap, "vehicle": problem.params}
    found = {one.name: getattr(result, one.name) for one in fields(result) if one.name != "x"}
    found |= {"energies": dict(spent), "leg_angles": result.leg_angles}
    return {"asked": dict(asked), "problem": stated, "result": found}


def result_units(problem: PostureProblem) -> dict[str, object]:
    """Units of the numbers in `result_content`, by their names."""
    unit = problem.criterion.unit
    values = dict.fromkeys(("value", "lower_bound", "fine_value"), unit)
    lengths = dict.fromkeys(("x", "fine_spacing", "min_clearance"), "m")
    forces = dict.fromkeys(("min_normal", "min_grip"), "N")
    rest = {"max_torque": "N m", "leg_rate": "rad/m", "leg_angles": "rad", "friction": "-"}
    rest |= {"energies": "J"} | {"residuals": UNITS, "seconds": "s"}
    return {"problem": lengths | forces | rest, "result": values | lengths | rest}
