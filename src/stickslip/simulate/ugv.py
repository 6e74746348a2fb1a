"""`stickslip simulate ugv`: a drive with given leg angles, as stations, criteria and a picture."""

from __future__ import annotations

from argparse import Namespace
from collections import Counter
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.agents.pictures.episodes import write_pictures
from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.scene import paint
from stickslip.envs.rendering.sheet import png
from stickslip.envs.ugv.picture import station_frames, ugv_picture
from stickslip.optim import PostureProblem, Station
from stickslip.optim.columns import ColumnSpec, read_columns
from stickslip.optim.posture.problem import refined
from stickslip.optim.posture.track_file import Survey
from stickslip.optimise import ugv
from stickslip.optimise.picture import draw_drive
from stickslip.records.files import require_suffix, write_whole
from stickslip.records.table import Column, Content, Table
from stickslip.report import one_row, require_files, show, write_simulation

if TYPE_CHECKING:
    from jaxtyping import Float

COLUMNS = (
    ColumnSpec(ugv.FRONT_WHEEL, "m", ("x",)),
    ColumnSpec(ugv.REAR_LEG, "rad", ("rear",)),
    ColumnSpec(ugv.FRONT_LEG, "rad", ("front",)),
)
OF_OPTIMISE = f"{ugv.STATIONS} of `stickslip optimise ugv`, its directory, or "
FPS, SPEED = 25.0, 1.0
"""Pictures a second of a film, and the speed of a drive in it [m/s]; its statics know no time."""


def simulate_command(flags: Mapping[str, Any]) -> Content:
    """Evaluate a drive, print and write it; NOTHING_FOUND where it breaks a constraint."""
    given = Namespace(**flags)
    problem, x, survey = drive_of(given)
    require_files(given, float(problem.x[-1] - problem.x[0]) / SPEED)
    stations, found = problem.stations(x), problem.evaluate(x)
    tables = {"summary": drive_summary(problem, stations, found.feasible)}
    tables["criteria"] = ugv.criteria_table(problem, x)
    tables |= {"ground": ugv.ground_table(survey)} if given.ground else {}
    show(*tables.values())
    for name, by in found.residuals.items():
        if by > 0 and not found.feasible:
            print(f"misses {name} by {by:.3g} {ugv.UNITS[name]}")

    def plot(path: Path) -> None:
        surface = problem.track.surface
        mu = "of the track" if surface and surface.measured else f"{given.friction:g}"
        title = f"Over {given.track}, friction {mu}"
        write_whole(path, png(draw_drive(problem, x), title), overwrite=given.overwrite)

    film = partial(film_drive, problem, x)
    written = write_simulation(given, ugv.stations_table(stations), plot, film)
    about = {"feasible": found.feasible, "missed": found.residuals, "files": written}
    return Content(tables, about, {"missed": ugv.UNITS}, OK if found.feasible else NOTHING_FOUND)


def drive_of(given: Namespace) -> tuple[PostureProblem, np.ndarray, Survey]:
    """The problem whose constraints the drive is held to, its leg angles, flat, and the ground.

    ValueError for flags that contradict each other, and for angles beyond the legs' range.
    """
    if (given.posture is None) == (given.angles is None):
        raise ValueError("accepted: one of --posture FILE and --angles REAR FRONT")
    vehicle, survey, limits = ugv.vehicle_on_track(given)
    if given.posture is not None:
        for name in ("spacing", "start", "end"):
            if getattr(given, name) is not None:
                raise ValueError(f"{name} with --posture, which has waypoints of its own")
        x, angles = read_posture(given.posture)
        return PostureProblem(vehicle, survey.track, x, **limits), angles.reshape(-1), survey
    problem = ugv.problem_along(given, survey, vehicle, **limits)
    low, high = (end[:2] for end in problem.bounds)
    angles = np.radians(np.asarray(given.angles, float))
    if not np.all((angles >= low) & (angles <= high)):
        raise ValueError(
            f"--angles {' '.join(f'{one:g}' for one in given.angles)}; accepted: each from "
            f"{np.degrees(low[0]):g} to {np.degrees(high[0]):g} degrees"
        )
    return problem, np.tile(angles, len(problem.x)), survey


def drive_summary(problem: PostureProblem, at: Station, feasible: bool) -> Table:
    """One row. status: the first that is not OK. slips, rollovers: numbers of waypoints."""
    codes = np.asarray(at.status)
    bad = np.flatnonzero(codes != Status.OK)
    status = Status(int(codes[bad[0]])).name if bad.size else "OK"
    counts = Counter(Status(int(code)).name for code in codes)
    row: dict[Column, object] = {
        Column("status", words=True): status,
        Column("within_limits", words=True): "yes" if feasible else "no",
        Column("first_at", "m"): float(problem.x[bad[0]]) if bad.size else None,
        Column("waypoints"): len(problem.x),
        Column("distance", "m"): float(problem.x[-1] - problem.x[0]),
        Column("slips"): counts["WHEEL_SLIP"],
        Column("rollovers"): counts["ROLLOVER"],
        Column("least_grip_margin", "N"): float(np.min(at.grip)),
        Column("least_normal_force", "N"): float(min(np.min(at.N_rear), np.min(at.N_front))),
        Column("largest_torque", "N m"): float(np.max(np.abs(at.torque))),
        Column("least_clearance", "m"): float(np.min(at.clearance)),
        Column("least_between_wheels", "m"): float(np.min(at.wheel_clearance)),
    }
    return one_row(row)


def read_posture(text: str) -> tuple[Float[np.ndarray, "K"], Float[np.ndarray, "K 2"]]:
    """Places of the front wheel [m] and rear and front leg angles [rad] from a file.

    ValueError naming the file and the line of what will not do.
    """
    path = Path(text)
    path = path / ugv.STATIONS if path.is_dir() else path
    require_suffix(path, (".csv",))
    if not path.exists():
        raise ValueError(f"posture {text!r}: no file {path}; accepted: {OF_OPTIMISE}such a .csv")
    found = read_columns(path, COLUMNS, also=OF_OPTIMISE)
    if len(found) < 2:
        raise ValueError(f"{path}: one row; accepted: 2 or more")
    return found[:, 0], found[:, 1:]


def film_drive(problem: PostureProblem, x: np.ndarray, path: Path) -> Path:
    """Write a film of the drive at SPEED, legs turning evenly between waypoints; return the path.

    The header has the largest torque so far.
    """
    length, last = float(problem.x[-1] - problem.x[0]), len(problem.x) - 1
    fine, angles = refined(problem, x, max(1, round(FPS * length / SPEED / last)))
    stations, last = fine.stations(angles), len(fine.x) - 1
    largest = np.maximum.accumulate(np.abs(stations.torque))
    ground = fine.posture.odometer, fine.posture.friction, fine.posture.params, fine.solver
    with jax.enable_x64(True):
        frames = station_frames(stations, largest, *ground, start=float(fine.x[0]))
    draw = partial(paint, ugv_picture(frames, problem.params, "largest torque", "N m"))
    return write_pictures(draw, last, length / SPEED / last, path, FPS, progress=True)
