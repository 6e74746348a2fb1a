"""Evaluation of a drive between its waypoints, the legs moving evenly from one to the next.

A posture problem knows its waypoints alone: what a drive costs between them, and whether it meets
the constraints there, is no part of it. This measures both.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.result import missed_by, tolerated
from stickslip.optim.posture.station import Station

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem
    from stickslip.optim.posture.result import PostureResult

FACTOR = 10
"""Refinement factor of a drive."""
LEAST_PAD, MOST = 1024, 2**17
"""For the value stations are padded to a power of two, so that few sizes are compiled; no more than
MOST are looked at, by a lower factor."""


def finer(problem: PostureProblem, factor: int = FACTOR) -> PostureProblem:
    """The problem with `factor` steps in place of each; friction runs straight between waypoints.

    Its constraints hold at more places, so it is another problem, with an optimum of its own.
    """
    factor = require_integer("factor", factor)
    x = _between(problem.x, factor)
    friction = problem.friction
    if np.ndim(friction):
        friction = _between(np.asarray(friction, float), factor)
    return replace(problem, x=x, friction=friction)


def evaluate_finer(
    problem: PostureProblem, x: Float[np.ndarray, "n"], factor: int = FACTOR
) -> dict[str, Any]:
    """Fields of PostureResult of a drive between its waypoints, `factor` times finer; less where
    that makes too many. The value is infinite where there are no forces."""
    factor = max(min(factor, MOST // len(problem.x)), 1)
    fine = finer(problem, factor)
    angles = _between(problem.angles(x), factor)
    count = len(fine.x)
    size = max(LEAST_PAD, 1 << (count - 1).bit_length())
    rows = evaluate.rows_at(fine.posture, fine.posture.x, fine.posture.friction, angles)
    whole = evaluate.padded(rows.T, size).T
    residuals = missed_by(fine, angles, Station.unpacked(rows))
    return {
        "fine_value": float(evaluate.value(fine.posture.criterion, whole, np.int32(count))),
        "fine_spacing": float(np.max(np.diff(fine.x))),
        "fine_feasible": all(by <= tolerated(fine, name) for name, by in residuals.items()),
        "fine_residuals": residuals,
    }


def _between(rows: np.ndarray, factor: int) -> np.ndarray:
    """Numbers at waypoints [K, ...] and evenly between them, [(K - 1) factor + 1, ...]."""
    share = np.arange(factor).reshape(-1, *[1] * (rows.ndim - 1)) / factor
    inner = rows[:-1, None] + share * (rows[1:] - rows[:-1])[:, None]
    return np.concatenate([inner.reshape(-1, *rows.shape[1:]), rows[-1:]])


def result_at(problem: PostureProblem, x: Float[np.ndarray, "n"], **others: Any) -> PostureResult:
    """See Problem.result: the drive is evaluated between its waypoints, too."""
    x = np.array(x, dtype=float).reshape(-1)
    return problem.result(x, **evaluate_finer(problem, x), **others)
