"""Stored lower bounds of every drive over the named tracks: proved.json.

`python -m benchmarks.bounds --update` writes it, `tests/agents/ugv/test_proved.py` proves some of
it again. Only the task of the environment's defaults is there; anything else has to be proved anew
(`bound_every_drive`).
"""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.dynamics.plain_checks import shown
from stickslip.dynamics.ugv import Track
from stickslip.optim.posture.problem import PostureProblem

if TYPE_CHECKING:
    from stickslip.optim.posture.stations.data import PostureData

FILE = Path(__file__).with_name("proved.json")
FORMAT, VERSION = "stickslip proved bounds", 1
ACCEPTED = "accepted: the file as `python -m benchmarks.bounds --update` writes it"
SAME = 1e-6
"""Numbers that differ by less, in parts of them (or of 1), are the same: an environment's are in
single precision."""
ROUNDING = 5e-4
"""By which a bound is lowered for that, in parts of it: an allowance, not proved."""
STRAIGHT = (np.pi / 2, np.pi / 2)


@lru_cache(maxsize=64)
def named_problem(track: str, criterion: str) -> PostureProblem:
    """The task of the environment's defaults over a named track: 0.1 m a step, 1 rad/m, friction
    0.8, legs straight down at the start, the end free."""
    return PostureProblem.along(Track.named(track), criterion, leg_rate=1.0, start_angles=STRAIGHT)


def proved(problem: PostureData) -> float:
    """Stored lower bound of every drive; NaN where there is none.

    ValueError naming the file where it is damaged.
    """
    if problem.solver.method != "newton" or problem.solver.overlap:
        return np.nan  # hollow ground may look otherwise to it, and wheels that overlap cost less
    for track, criterion, bound in _read(FILE):
        if criterion == problem.criterion.name and _same(problem, named_problem(track, criterion)):
            return bound - ROUNDING * abs(bound)
    return np.nan


@lru_cache(maxsize=2)
def _read(path: Path) -> tuple[tuple[str, str, float], ...]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        if (content["format"], content["version"]) != (FORMAT, VERSION):
            raise ValueError(f"format {content['format']}, version {content['version']}")
        rows = [(str(one["track"]), str(one["criterion"]), one["bound"]) for one in content["rows"]]
        wrong = [row for row in rows if type(row[2]) not in (int, float) or not np.isfinite(row[2])]
        if wrong:
            raise ValueError(f"{shown(wrong[0])} is no finite bound")
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path}: {shown(error)}; {ACCEPTED}") from error
    return tuple(rows)


def _same(one: PostureData, other: PostureData) -> bool:
    """True if two problems pose the same task: ground, vehicle, waypoints and limits."""
    pairs = [(of.track.shape, of.track.surface, of.params) for of in (one, other)]
    if jax.tree.structure(pairs[0]) != jax.tree.structure(pairs[1]):
        return False
    numbers = [
        [*jax.tree.leaves(pair), of.x, of.friction, of.min_normal, of.min_grip]
        for pair, of in zip(pairs, (one, other), strict=True)
    ]
    for name in ("leg_rate", "start_angles", "end_angles"):
        values = [getattr(of, name) for of in (one, other)]
        if (values[0] is None) != (values[1] is None):
            return False
        if values[0] is not None:
            for of, value in zip(numbers, values, strict=True):
                of.append(value)
    return all(_near(a, b) for a, b in zip(*numbers, strict=True))


def _near(a: object, b: object) -> bool:
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape and 1 not in (a.size, b.size):
        return False
    return bool(np.all(np.abs(a - b) <= SAME * np.maximum(1.0, np.abs(b))))
