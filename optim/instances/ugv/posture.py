"""Leg angles of the UGV over a track: many numbers, each tied to its neighbours only."""

from __future__ import annotations

import numpy as np

from stickslip.dynamics.ugv import Track
from stickslip.optim.posture.problem import PostureProblem

STRAIGHT = np.full(2, np.pi / 2)
LEG_RATE = 1.0
ROUGH = {"key": 7, "end": 10.0}
"""The rough track: of ISO class C, generated from this key."""


def track_named(name: str) -> Track:
    """A track of the suite: those of `Track` as they are, "rough" from ROUGH."""
    return Track.named(name, **(ROUGH if name == "rough" else {}))


def posture_problem(
    track: str, criterion: str, free: int, ends: str = "start", friction: float = 0.8
) -> PostureProblem:
    """`free` numbers to choose over the whole of a track.

    ends: "start": legs straight down at the first waypoint, the last free; "both": straight down at
    both; "none": all free. The waypoints are as many as that takes, evenly spaced, and legs turn by
    at most LEG_RATE [rad/m].
    """
    ground = track_named(track)
    given = {"start": 1, "both": 2, "none": 0}[ends]
    first, *_, last = PostureProblem.along(ground).x
    return PostureProblem(
        PostureProblem.along(ground).params,
        ground,
        np.linspace(first, last, free // 2 + given),
        criterion,
        friction=friction,
        leg_rate=LEG_RATE,
        start_angles=STRAIGHT if given else None,
        end_angles=STRAIGHT if ends == "both" else None,
    )


def posture_goals(track: str, criteria: tuple[str, ...], free: int) -> tuple[PostureProblem, ...]:
    """The same drive by several criteria."""
    return tuple(posture_problem(track, one, free) for one in criteria)
