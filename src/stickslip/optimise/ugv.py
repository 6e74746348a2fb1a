"""`stickslip optimise ugv`: build a posture problem, solve it, print and write the result."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.lazily import require
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver
from stickslip.dynamics.ugv.params import vehicle_text
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, solve
from stickslip.optim.posture.evaluate import tolerated
from stickslip.optim.problem import methods_of, options_of_method
from stickslip.optimise.machine import ground_table, track_options_of, vehicle_on_track
from stickslip.optimise.picture import draw_drive, draw_ground
from stickslip.records.table import Column, Content, Table, json_text
from stickslip.report import RESULT, one_row, picture, result_folder, show, with_unit, write_result

if TYPE_CHECKING:
    from stickslip.optim import Station

STATIONS, PICTURE, VEHICLE = "stations.csv", "drive.png", "vehicle.toml"
GROUND = ("ground.csv", "ground.png")
CLOSEST = ("closest.csv", "closest.png")
"""The drive that misses least, where none meets the constraints."""
FRONT_WHEEL, REAR_LEG, FRONT_LEG = "front wheel", "rear leg angle", "front leg angle"
"""Columns that define a drive; all others follow from them."""
UNITS: dict[str, str] = {"leg_range": "rad", "start_angles": "rad", "end_angles": "rad"}
UNITS |= {"leg_rate": "rad/m", "grip": "N", "normal": "N", "clearance": "m", "wheels": "m"}
UNITS |= {"torque": "N m", "pose": "waypoints"}
"""Units of PostureProblem.residuals."""
STATED = ("friction", "leg_rate", "min_normal", "min_grip", "min_clearance", "max_torque")
STATED += ("start_angles", "end_angles", "x", "free_split")
"""Numbers of a problem that result.json holds."""
RUNS = 6
"""Blocked stretches of ground that are listed."""
SPACING, POLISHED = 0.1, 2000
"""Waypoints are SPACING [m] apart. A path of more than POLISHED is not polished, unless asked."""


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Solve a posture problem, print and write the drive; NOTHING_FOUND without one."""
    given = Namespace(**flags)
    default = f"runs/ugv-{Path(given.track).stem}-{given.criterion}-{given.method}"
    out = result_folder(given.out or default, given.overwrite)
    require_choice("criterion", given.criterion, tuple(CRITERIA))
    require_choice("method", given.method, tuple(METHODS))
    vehicle, survey, limits = vehicle_on_track(given)
    problem = PostureProblem.along(
        survey.track,
        given.criterion,
        vehicle,
        spacing=SPACING if given.spacing is None else given.spacing,
        start=given.start,
        end=given.end,
        start_angles=given.start_angles,
        end_angles=given.end_angles,
        solver=PoseSolver(overlap=given.overlap),
        free_split=given.free_split,
        **limits,
    )
    if given.pictures:
        require("matplotlib.figure")
    if given.method == "cma":
        require("cma", "the method 'cma'", "optim")  # before anything is computed in vain
    result = solve(problem, given.method, progress=True, **_method_options(given, problem))
    summary, tables, x = result_summary(problem, result), {}, result.x
    files: dict[str, Any] = {}
    if given.vehicle is not None or given.changes:
        files[VEHICLE] = lambda: vehicle_text(vars(problem.params), problem.max_torque)
    files |= _drive_files(given, problem, result)
    if x is not None:
        tables["criteria"] = criteria_table(problem, x)
    if given.ground:
        tables["ground"] = ground_table(survey)
        files[GROUND[0]] = Table([Column("x", "m"), Column("y", "m")], survey.used.tolist()).csv
        files[GROUND[1]] = picture(lambda: draw_ground(survey), f"Ground of {given.track}")
    if not given.pictures:
        files = {name: make for name, make in files.items() if not name.endswith(".png")}
    show(summary, *tables.values())
    asked = vars(given) | {"track_options": track_options_of(given.track_options)}
    facts: dict[str, object] = {"asked": asked, **result_content(problem, result)}
    rows = {name: one.records() for name, one in tables.items()}
    files = {RESULT: lambda: json_text(facts | rows), **files}
    written = write_result(
        out, files, (STATIONS, PICTURE, VEHICLE, *GROUND, *CLOSEST), given.overwrite
    )
    status = OK if x is not None else NOTHING_FOUND
    return Content({"summary": summary, **tables}, facts | {"files": written}, status=status)


def _drive_files(
    given: Namespace, problem: PostureProblem, result: PostureResult
) -> dict[str, Any]:
    """Files of the drive, or of the one that misses least where none meets the constraints."""
    x, names = result.x, (STATIONS, PICTURE)
    over = f"over {Path(given.track).stem}"
    if x is None:
        if result.details.get("closest") is None:
            return {}
        x, names = np.ravel(result.details["closest"]), CLOSEST
        title = f"Misses the constraints least {over}"
    else:
        name = given.criterion.replace("_", " ").capitalize()
        value = with_unit(result.value, problem.criterion.unit, 4)
        title = f"{name} {value} {over}, by {result.method}"
    stations = stations_table(problem.stations(x)).csv
    return {names[0]: stations, names[1]: picture(lambda: draw_drive(problem, x), title)}


def _method_options(given: Namespace, problem: PostureProblem) -> dict[str, Any]:
    """Options of the method. ValueError for one that it does not take."""
    asked = {"angles": given.angles, "seed": given.seed}
    options: dict[str, Any] = {name: one for name, one in asked.items() if one is not None}
    taken = options_of_method(methods_of(problem)[given.method])
    for name in options:
        if name not in taken:
            raise ValueError(f"--{name} with --method {given.method}; accepted: without it")
    polish = given.polish
    return options | {"polish": len(problem.x) <= POLISHED if polish is None else polish}


def result_summary(problem: PostureProblem, result: PostureResult) -> Table:
    """One row: value, bounds, the value between waypoints, violations, cost."""
    unit, details, found = problem.criterion.unit, result.details, result.x is not None
    grid, bound = details.get("grid"), details.get("grid_bound")
    if bound is not None and found and bound > result.value * (1 + 1e-9):
        bound = None  # the drive's angles are between those of the grid
    said = result.message if result.message != result.status.value else None
    return one_row(
        {
            Column("criterion", words=True): problem.criterion.name,
            Column("waypoints"): len(problem.x),
            Column("status", words=True): result.status_in_words,
            Column("message", words=True): said,
            Column("grid", words=True): grid and f"{grid[0]} x {grid[1]} leg angles",
            Column("value", unit): float(result.value) if found else None,
            Column("lower_bound", unit): result.lower_bound,
            Column("bound_over_the_grid", unit): bound,
            Column("value_between_waypoints", unit): float(result.fine_value) if found else None,
            Column("violated", words=True): _violated(problem, result.residuals),
            Column("violated_between", words=True): _violated(problem, result.fine_residuals),
            **_shortfall_columns(details),
            Column("evaluations"): result.evaluations,
            Column("time", "s"): float(result.seconds),
        }
    )


def _shortfall_columns(details: Mapping[str, Any]) -> dict[Column, object]:
    """Where no drive meets the constraints: where, which, what friction would do."""
    if "blocked" not in details:
        return {}
    angle, place = details["steepest"]
    missed = (
        f"{name} by {by:.4g} {UNITS[name]} at {at:.5g} m"
        for name, (by, at) in details["misses"].items()
    )
    runs = [f"{first:.5g} to {last:.5g} m" for first, last in details["blocked"]]
    more = f" and {len(runs) - RUNS} more" if len(runs) > RUNS else ""
    return {
        Column("no_pair_of_angles_from", words=True): ", ".join(runs[:RUNS]) + more,
        Column("misses_least", words=True): ", ".join(missed),
        Column("least_friction"): details["least_friction"],
        Column("steepest", words=True): f"{np.degrees(angle):.3g} degrees at {place:.5g} m",
    }


def _violated(problem: PostureProblem, residuals: Mapping[str, float]) -> str:
    """Violations beyond the tolerance of feasibility."""
    worst = {name: by for name, by in residuals.items() if by > tolerated(problem, name)}
    return ", ".join(f"{name} {by:.3g} {UNITS[name]}" for name, by in worst.items())


def result_content(problem: PostureProblem, result: PostureResult) -> dict[str, object]:
    """The problem's numbers and the result."""
    stated = {name: getattr(problem, name) for name in STATED}
    stated |= {"criterion": problem.criterion.name, "unit": problem.criterion.unit}
    if problem.track.surface is not None and problem.track.surface.measured:
        stated["friction"] = None
    stated |= {"overlap": problem.solver.overlap, "vehicle": problem.params}
    found = {one.name: getattr(result, one.name) for one in fields(result) if one.name != "x"}
    return {"problem": stated, "result": found | {"leg_angles": result.leg_angles}}


def stations_table(found: Station) -> Table:
    """A row a waypoint, numbers in SI units and radians, every digit."""
    torques = np.asarray(found.motors[0]).T
    wheels = ["each wheel"] if len(torques) == 1 else ["the rear wheel", "the front wheel"]
    columns: dict[Column, object] = {
        Column(FRONT_WHEEL, "m"): found.x,
        Column(REAR_LEG, "rad"): found.leg_angles[:, 0],
        Column(FRONT_LEG, "rad"): found.leg_angles[:, 1],
        **{Column(f"torque on {of}", "N m"): M for of, M in zip(wheels, torques, strict=True)},
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


def criteria_table(problem: PostureProblem, x: np.ndarray) -> Table:
    """Value of the drive by every criterion: the lower the better."""
    heads = [Column("criterion", words=True), Column("value"), Column("unit", words=True)]
    rows = []
    for name in CRITERIA:
        own = replace(problem, criterion=name)
        rows.append([name, own.objective(x), own.criterion.unit])
    return Table(heads, rows)
