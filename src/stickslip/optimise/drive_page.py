"""A solved posture problem as a page: the drive to play, its numbers and its picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.agents.ugv.shown import drive_numbers, drive_panels
from stickslip.envs.rendering.html.data import Page, Shown
from stickslip.envs.rendering.ugv.drawn import ugv_drawing
from stickslip.envs.ugv.picture import station_frames
from stickslip.optim.posture.criteria import CRITERIA, station_cost, step_cost, steps
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.optim import PostureProblem, PostureResult
    from stickslip.optim.posture.criteria import Criterion
    from stickslip.optim.posture.station import Station

SPEED = 1.0
"""Of the front wheel in pictures [m/s]: nothing else knows of time."""
COLUMNS = (Column("name", words=True), Column("value", words=True))


def result_page(
    title: str,
    rows: Sequence[tuple[str, str]],
    episodes: tuple[Shown, ...],
    picture: bytes | None = None,
) -> Page:
    """What an optimisation ends with. rows: as the command prints them."""
    table = Table(COLUMNS, [row for row in rows if row[1]])
    pictures = () if picture is None else (("The same as a picture", picture),)
    return Page(title, tables=(("", table),), episodes=episodes, pictures=pictures)


def drive_shown(problem: PostureProblem, result: PostureResult) -> Shown:
    """The drive, waypoint by waypoint. ValueError for a result without one."""
    if result.x is None:
        raise ValueError(
            f"the result holds no drive ({result.message}); accepted: one with a drive"
        )
    posture, at = problem.posture, problem.stations(result.x)
    criterion = problem.criterion
    with jax.enable_x64(True):
        cost = _so_far(criterion, at)
        work = [
            np.concatenate([[np.nan], step_cost(CRITERIA[name], *steps(at))])
            for name in ("wheel_energy", "total_energy")
        ]
        frames = station_frames(
            at, cost, posture.odometer, posture.friction, posture.params, problem.solver
        )
    spacing = np.diff(problem.x, prepend=np.nan)
    panels = drive_panels(frames, at, cost, [each / spacing for each in work], 1.0, criterion)
    return Shown(
        name=result.method,
        period=float(np.mean(np.diff(problem.x))) / SPEED,
        panels=panels,
        numbers=drive_numbers(frames, criterion),
        slips=np.array([frame.slips for frame in frames]),
        drawing=ugv_drawing(frames, problem.params),
        facts=(("shown at", f"{SPEED:g} m/s"),),
    )


def _so_far(criterion: Criterion, at: Station) -> np.ndarray:
    """The criterion of the way to each station."""
    if criterion.kind == "max":
        return np.maximum.accumulate(np.asarray(station_cost(criterion, at), float))
    return np.concatenate([[0.0], np.cumsum(step_cost(criterion, *steps(at)))])
