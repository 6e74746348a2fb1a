"""The grid of leg angles that wastes least of what the legs may turn, and how much a grid uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_integer

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem

LEAST = 31
"""Default least number of angles of each leg in a grid."""
FINEST = 96
"""Angles of each leg that a fitting grid has at most."""
USED = 0.95
"""Share of the legs' rate that moves over the grid should be able to use."""
ROUNDING = 1e-9
"""Part of a grid step, or of an allowed move, by which a move may seem too long."""


def fitting_grid(
    problem: PostureProblem, least: int = LEAST
) -> tuple[Float[np.ndarray, "R"], Float[np.ndarray, "F"]]:
    """Evenly spaced angles of the rear and of the front leg [rad], at least so many each.

    On a grid a leg moves by whole steps alone: with steps of 70 % of what the rate allows between
    waypoints, 30 % of the rate lie idle, and all of it with steps of 101 %. So the step is a whole
    part of leg_rate times the shortest spacing, and the angles run through the given start and
    end (through the start alone where no such step leads from one to the other; through the middle
    of the range where neither is given). Less than a step is left out at the ends of the range.
    Where FINEST angles do not suffice, only those within reach of the given ends are taken; and
    where even these are too many, or the rate has no limit, `least` over the whole range.
    """
    least = require_integer("least", least, low=2)
    ends = [of for of in (problem.start_angles, problem.end_angles) if of is not None]
    rear, front = (_of_leg(problem, [float(at[leg]) for at in ends], least) for leg in (0, 1))
    return rear, front


def _of_leg(problem: PostureProblem, ends: list[float], least: int) -> np.ndarray:
    """One leg's angles; ends: its angles where the first or the last pair is given."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    if low == high:
        return np.array([low])
    whole = np.linspace(low, high, least)
    if problem.leg_rate is None:
        return whole
    spacing = np.diff(problem.x)
    limit = float(problem.leg_rate) * float(np.min(spacing))
    reach = float(problem.leg_rate) * float(np.sum(spacing))
    near = max([low, *(at - reach for at in ends)]), min([high, *(at + reach for at in ends)])
    most = max(FINEST, least)
    for below, above in ((low, high), near):
        width = above - below
        if not 0 < width <= limit * (most - 1) * (1 + ROUNDING):
            continue
        parts = max(int(np.ceil(limit * least / width - ROUNDING)), 1)
        finest = max(int(limit * (most - 1) / width + ROUNDING), parts)
        step = _step(limit, range(parts, finest + 1), ends)
        return _through(ends[0] if ends else (below + above) / 2, step, below, above)
    return whole


def _step(limit: float, parts: range, ends: list[float]) -> float:
    """The longest step that uses the rate well and leads from the one given angle to the other;
    or the longest that uses the rate."""
    between = abs(ends[-1] - ends[0]) if ends else 0.0
    for part in parts:
        longest = limit / part
        if between <= ROUNDING * longest:
            return longest
        step = between / np.ceil(between / longest - ROUNDING)
        if step >= USED * longest:
            return float(step)
    return limit / parts[0]


def _through(at: float, step: float, low: float, high: float) -> np.ndarray:
    """All angles that are whole steps from `at`, within the range."""
    first = -int((at - low) / step + ROUNDING)
    last = int((high - at) / step + ROUNDING)
    return np.clip(at + step * np.arange(first, last + 1), low, high)


def step_of(angles: Float[np.ndarray, "n"]) -> float:
    """The distance of neighbouring angles [rad]; 0 for one angle."""
    return float(angles[-1] - angles[0]) / max(len(angles) - 1, 1)


def windows_of(
    angles: Float[np.ndarray, "n"], limits: Float[np.ndarray, "k"]
) -> Float[np.ndarray, "k"]:
    """Grid steps that a leg may move in each step of the drive; limits: the longest [rad]."""
    most = len(angles) - 1
    if most == 0:
        return np.zeros(limits.shape)
    return np.minimum(np.floor(limits / step_of(angles) + ROUNDING), most)


def rate_used(angles: Float[np.ndarray, "n"], limits: Float[np.ndarray, "k"]) -> float:
    """The share of its rate that a leg can use on these angles, 0 to 1; 1 where it can reach
    every one of them in a single step."""
    most = len(angles) - 1
    windows = windows_of(angles, limits)
    if most == 0 or np.all(windows == most):
        return 1.0
    return float(min(np.sum(windows) * step_of(angles) / np.sum(limits), 1.0))
