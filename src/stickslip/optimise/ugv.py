"""`stickslip optimise ugv`: build a posture problem, solve it, print and write what came out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.envs.rendering.extras import require
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, solve
from stickslip.optim.posture.evaluate import tolerated
from stickslip.optim.problem import methods_of, options_of_method
from stickslip.optimise.flags import PostureOptions
from stickslip.optimise.machine import finite, own_files, torque_limit_of, vehicle_of
from stickslip.optimise.shared import finished, require_folder, track_of, track_options_of
from stickslip.parser import options_of
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stickslip.optim import Station

ENERGIES = {
    "wheel_energy": "work of the wheels' motors",
    "total_energy": "the same with the legs' actuators",
}
"""Positive work only, none recovered. The first alone says little: legs that lift the vehicle
spare its wheels."""
STATIONS, PICTURE = "stations.csv", "drive.png"
FRONT_WHEEL, REAR_LEG, FRONT_LEG = "front wheel", "rear leg angle", "front leg angle"
"""Columns of a drive that say what it is; all others follow from them."""
NOTABLE = 0.05
"""Relative difference of the value between waypoints above which there is a warning."""
UNITS: dict[str, str] = {"leg_range": "rad", "start_angles": "rad", "end_angles": "rad"}
UNITS |= {"leg_rate": "rad/m", "grip": "N", "normal": "N", "clearance": "m", "wheels": "m"}
UNITS |= {"torque": "N m", "pose": "waypoints"}
"""Units of PostureProblem.residuals."""
STATED = ("friction", "leg_rate", "min_normal", "min_grip", "min_clearance", "max_torque")
STATED += ("start_angles", "end_angles", "x")
"""Numbers of a problem that result.json holds."""
ASKED = (
    *("track", "track_options", "columns", "method"),
    *("spacing", "start", "end", "angles", "polish", "seed"),
)
"""Options that result.json repeats; the others stand in its problem."""
SPACING, MOST_WAYPOINTS, POLISHED = 0.1, 5000, 2000
"""Waypoints are SPACING [m] apart, or more where there would be more than MOST_WAYPOINTS; a path of
more than POLISHED is not polished, unless it is asked for."""


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Solve a posture problem, print and write the drive; NOTHING_FOUND without one.

    Writes DIR/stations.csv, result.json and drive.png, each under a temporary name first; without
    a drive only result.json. Wrong input is refused before anything is computed or written.
    """
    given = options_of(PostureOptions, flags)
    default = f"runs/ugv-{Path(given.track).stem}-{given.criterion}-{given.method}"
    out = require_folder(given.out or default, given.overwrite)
    require_choice("criterion", given.criterion, tuple(CRITERIA))
    require_choice("method", given.method, tuple(METHODS))
    problem = problem_of(given)
    if given.pictures:
        require("matplotlib.figure")
    if given.method == "cma":
        import cma  # noqa: F401  (where it is missing, nothing is computed in vain)
    options = _method_options(given, problem)
    result = solve(problem, given.method, progress=True, **options)
    spent = energies(problem, result.x)
    said = [] if result.x is None else warnings(problem, result)
    asked = asdict(given) | {"track_options": track_options_of(given.track_options)}
    found = result_content(problem, result, spent, {name: asked[name] for name in ASKED})
    tables, picture = own_files(given, problem.params), None
    if result.x is not None:
        tables[STATIONS] = stations_table(problem.stations(result.x)).csv()
        x, track = result.x, Path(given.track).name
        picture = PICTURE, lambda: _picture(problem, result, x, track)
    lines = rows(problem, result, spent)
    units = result_units(problem)
    return finished(
        out, given, lines, said, found, units, tables, (STATIONS, PICTURE, "vehicle.toml"), picture
    )


def _method_options(given: PostureOptions, problem: PostureProblem) -> dict[str, Any]:
    """Options of the method. ValueError for one that it does not take."""
    asked = {"angles": given.angles, "seed": given.seed}
    options: dict[str, Any] = {name: one for name, one in asked.items() if one is not None}
    taken = options_of_method(methods_of(problem)[given.method])
    for name in options:
        if name not in taken:
            raise ValueError(f"--{name} with --method {given.method}; accepted: without it")
    polish = given.polish
    return options | {"polish": len(problem.x) <= POLISHED if polish is None else polish}


def spacing_of(track: Track, given: PostureOptions) -> float:
    """Requested spacing, or the default for the track's length: see SPACING [m]."""
    if given.spacing is not None:
        return given.spacing
    start = float(track.start) if given.start is None else given.start
    end = float(track.end) if given.end is None else given.end
    return max(SPACING, (end - start) / (MOST_WAYPOINTS - 1))


def problem_of(given: PostureOptions) -> PostureProblem:
    """The problem that the flags describe."""
    track = track_of(given.track, given.track_options, given.columns)
    return PostureProblem.along(
        track,
        given.criterion,
        vehicle_of(given),
        spacing=spacing_of(track, given),
        start=given.start,
        end=given.end,
        leg_rate=finite(given.leg_rate),
        friction=given.friction,
        max_torque=torque_limit_of(given),
        start_angles=given.start_angles,
        end_angles=given.end_angles,
        solver=PoseSolver(overlap=given.overlap),
    )


def _picture(
    problem: PostureProblem, result: PostureResult, x: np.ndarray, track: str
) -> tuple[Figure, str]:
    from stickslip.optimise.picture import draw_drive

    name = problem.criterion.name.replace("_", " ")
    title = f"{name} {result.value:.5g}{_unit(problem)} over {track}, by {result.method}"
    return draw_drive(problem, x), title


def _unit(problem: PostureProblem) -> str:
    """The value's unit behind a number."""
    return "" if problem.criterion.unit == "-" else f" {problem.criterion.unit}"


def energies(problem: PostureProblem, x: np.ndarray | None) -> dict[str, float]:
    """A drive's two energies by the criteria's names [J]; none without a drive."""
    if x is None:
        return {}
    return {name: replace(problem, criterion=name).objective(x) for name in ENERGIES}


def rows(
    problem: PostureProblem, result: PostureResult, spent: Mapping[str, float]
) -> list[tuple[str, str]]:
    """Rows of the printed report: a name and its value. spent: `energies`."""
    unit, x = _unit(problem), problem.x
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
