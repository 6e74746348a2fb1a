"""A drive of a posture problem as a page shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.agents.ugv.shown import STATES, drive_numbers, drive_panels
from stickslip.envs.rendering.html.data import Shown
from stickslip.envs.rendering.ugv import ugv_drawing
from stickslip.envs.ugv.picture import station_frames
from stickslip.optim.posture.criteria import CRITERIA, station_cost, step_cost, steps

if TYPE_CHECKING:
    from stickslip.optim import PostureProblem
    from stickslip.optim.posture.criteria import Criterion
    from stickslip.optim.posture.station import Station

SPEED = 1.0
"""Of the front wheel in pictures [m/s]: nothing else knows of time."""


def drive_shown(problem: PostureProblem, x: np.ndarray, name: str) -> Shown:
    """A problem's drive, waypoint by waypoint; name: what it is called."""
    posture, at = problem.posture, problem.stations(x)
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
        name=name,
        period=float(np.mean(np.diff(problem.x))) / SPEED,
        panels=panels,
        numbers=drive_numbers(frames, criterion),
        slips=np.array([frame.slips for frame in frames]),
        drawing=ugv_drawing(frames, problem.params),
        states=STATES,
        facts=(("shown at", f"{SPEED:g} m/s"),),
    )


def _so_far(criterion: Criterion, at: Station) -> np.ndarray:
    """The criterion of the way to each station."""
    if criterion.kind == "max":
        return np.maximum.accumulate(np.asarray(station_cost(criterion, at), float))
    return np.concatenate([[0.0], np.cumsum(step_cost(criterion, *steps(at)))])
