"""`stickslip optimise ugv`: build a posture problem, solve it, print and write the result."""

import json
import math
from argparse import Namespace
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.lazily import require
from stickslip.dynamics.machine_file import quantity
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import TRACKS, PoseSolver, Track, UGVParams
from stickslip.dynamics.ugv.params import vehicle_text
from stickslip.envs.rendering.sheet import png
from stickslip.optim import CRITERIA, METHODS, PostureProblem, PostureResult, Station, solve
from stickslip.optim.columns import is_number
from stickslip.optim.posture import TREATMENTS
from stickslip.optim.posture.evaluate import tolerated
from stickslip.optim.posture.track_file import Survey, read_survey, require_track
from stickslip.optim.problem import methods_of, options_of_method
from stickslip.optimise.picture import draw_drive, draw_ground
from stickslip.parser import finite
from stickslip.records.table import Column, Content, Table, json_text, with_unit
from stickslip.report import RESULT, one_row, result_folder, write_result

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
    out = result_folder(given, default)
    require_choice("criterion", given.criterion, tuple(CRITERIA))
    require_choice("method", given.method, tuple(METHODS))
    vehicle, survey, limits = vehicle_on_track(given)
    limits |= {name: getattr(given, name) for name in ("start_angles", "end_angles", "free_split")}
    limits["solver"] = PoseSolver(overlap=given.overlap)
    problem = problem_along(given, survey, vehicle, given.criterion, **limits)
    if given.method == "cma":
        require("cma", "the method 'cma'", "optim")  # before anything is computed in vain
    result = solve(problem, given.method, progress=True, **_method_options(given, problem))
    tables, x = {"summary": result_summary(problem, result)}, result.x
    files = _drive_files(given, problem, result)
    if given.vehicle is not None or given.changes:
        files[VEHICLE] = lambda: vehicle_text(vars(problem.params), problem.max_torque)
    if x is not None:
        tables["criteria"] = criteria_table(problem, x)
    if given.ground:
        tables["ground"] = ground_table(survey)
        files[GROUND[0]] = Table([Column("x", "m"), Column("y", "m")], survey.used.tolist()).csv
        files[GROUND[1]] = lambda: png(draw_ground(survey), f"Ground of {given.track}")
    asked = vars(given) | {"track_options": track_options_of(given.track_options)}
    facts: dict[str, object] = {"asked": asked, **result_content(problem, result)}
    rows = {name: one.records() for name, one in tables.items() if name != "summary"}
    files[RESULT] = lambda: json_text(facts | rows)
    usual = STATIONS, PICTURE, VEHICLE, *GROUND, *CLOSEST
    return write_result(given, out, tables, facts, files, usual, x is not None)


def problem_along(
    given: Namespace, survey: Survey, vehicle: UGVParams, *criterion: str, **limits: Any
) -> PostureProblem:
    """Waypoints on the ground by the flags start, end and spacing."""
    spacing = SPACING if given.spacing is None else given.spacing
    places = {"start": given.start, "end": given.end, "spacing": spacing}
    return PostureProblem.along(survey.track, *criterion, params=vehicle, **places, **limits)


ROLLS = 1.1
"""Radius of the default envelope in wheel radii: at 1 a wheel would touch whole arcs at once."""


def vehicle_on_track(given: Namespace) -> tuple[UGVParams, Survey, dict[str, Any]]:
    """Vehicle, ground and limits of a drive: those that PostureProblem takes by name.

    The motors' torque limit is --max-torque, else that of the vehicle's file.
    """
    vehicle, motor = UGVParams.with_motor(given.vehicle, given.changes)
    survey = survey_of(given.track, given.track_options, treatments_of(given.ground, vehicle))
    torque = motor.get("max_torque", math.inf) if given.max_torque is None else given.max_torque
    limits = {"leg_rate": finite(given.leg_rate), "max_torque": finite(torque)}
    return vehicle, survey, {**limits, "friction": given.friction}


def survey_of(
    name: str, options: Iterable[str] = (), treatments: dict[str, Any] | None = None
) -> Survey:
    """The named track, or the one in the file of that name with its points. options: "name=value"
    each, of Track.named, or `interpolation` of a file. treatments: of the file's points."""
    given, path = track_options_of(options), Path(name)
    if name in TRACKS:
        if treatments:
            raise ValueError(f"--ground with track {name!r}; accepted: with a file of points")
        try:
            return Survey(Track.named(name, **given), np.empty((0, 2)), np.empty((0, 2)), {})
        except TypeError as error:
            raise ValueError(f"track {name!r} with {given}: {error}") from error
    require_track(name, TRACKS)
    unknown = [key for key in given if key != "interpolation"]
    if unknown:
        raise ValueError(f"a track in a file has no {unknown[0]!r}; accepted: interpolation")
    return read_survey(path, **given, **(treatments or {}))


def treatments_of(text: str | None, params: UGVParams) -> dict[str, float]:
    """The lengths [m] in --ground's "name=length,name", by the treatments' names."""
    found: dict[str, float] = {}
    defaults = {"merge": 0.0, "envelope": ROLLS * float(params.wheel_radius)}
    for word in [] if text is None else text.split(","):
        name, sign, value = map(str.strip, word.partition("="))
        require_choice("--ground", name, tuple(TREATMENTS))
        if not sign and name in defaults:
            found[name] = defaults[name]
        else:
            length = float(value) if is_number(value) else value
            found[name] = quantity(f"--ground {name}", length, "m")
    return found


def ground_table(survey: Survey) -> Table:
    """One row: what the treatments did to the points."""
    whole = ("points", "reordered", "dropped", "merged", "filled", "knots")
    units = {name: "-" if name in whole else "m" for name in survey.changes}
    return one_row({Column(name, units[name]): of for name, of in survey.changes.items()})


def track_options_of(words: Iterable[str]) -> dict[str, Any]:
    """name=value words as names and numbers or text; the last one counts."""
    found: dict[str, Any] = {}
    for word in words:
        name, sign, value = map(str.strip, word.partition("="))
        if not (sign and name and value):
            raise ValueError(f"--track-option {word!r}; accepted: name=value")
        try:
            found[name] = json.loads(value)
        except ValueError:
            found[name] = value
    return found


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
    return {names[0]: stations, names[1]: lambda: png(draw_drive(problem, x), title)}


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
    if bound is not None and found and bound > result.value + 1e-9 * abs(result.value):
        bound = None  # the drive's angles are between those of the grid
    said = result.message if result.message != result.status.value else None
    row: dict[Column, object] = {
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
        Column("search_time", "s"): float(result.seconds),
    }
    return one_row(row)


def _shortfall_columns(details: Mapping[str, Any]) -> dict[Column, object]:
    """Where no drive meets the constraints: where, which, what friction would do."""
    if "blocked" not in details:
        return {}
    (angle, place), misses = details["steepest"], details["misses"].items()
    missed = (f"{name} by {by:.4g} {UNITS[name]} at {at:.5g} m" for name, (by, at) in misses)
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
    columns: dict[Column, Any] = {
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
    columns = {name: np.asarray(values, float).tolist() for name, values in columns.items()}
    columns[Column("status", words=True)] = [Status(int(code)).name for code in found.status]
    return Table.of_columns(columns)


def criteria_table(problem: PostureProblem, x: np.ndarray) -> Table:
    """Value of the drive by every criterion: the lower the better."""
    heads = [Column("criterion", words=True), Column("value"), Column("unit", words=True)]
    every = {name: replace(problem, criterion=name) for name in CRITERIA}
    return Table(heads, [[name, of.objective(x), of.criterion.unit] for name, of in every.items()])
