"""Evaluation of a drive between its waypoints, the legs moving evenly from one to the next.

A posture problem knows its waypoints alone: what a drive costs between them, and whether it meets
the constraints there, is no part of it. This measures both.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import (
    Criterion,
    Weighted,
    largest,
    station_cost,
    step_cost,
    steps,
)
from stickslip.optim.posture.result import PostureResult, missed_by, tolerated
from stickslip.optim.posture.station import Station

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.optim.posture.problem import PostureProblem

FACTOR = 10
"""Refinement factor of a drive."""
LEAST_PAD, MOST = 1024, 2**17
"""For the value stations are padded to a power of two, so that few sizes are compiled; no more than
MOST are looked at, by a lower factor."""


class Fine(NamedTuple):
    """A drive on finer waypoints: the criterion's value, infinite where there are no forces; the
    longest step [m]; whether the constraints hold, and by how much each is missed at worst."""

    value: float
    spacing: float
    feasible: bool
    residuals: dict[str, float]


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
) -> Fine:
    """A drive between its waypoints, `factor` times finer; less where that makes too many."""
    factor = max(min(factor, MOST // len(problem.x)), 1)
    fine = finer(problem, factor)
    angles = _between(problem.angles(x), factor)
    count = len(fine.x)
    size = max(LEAST_PAD, 1 << (count - 1).bit_length())
    at = evaluate.stations(fine.posture, angles)
    with jax.enable_x64(True):
        whole = jax.tree.map(lambda of: evaluate.padded(of, size), at)
        value = float(_value(fine.posture.criterion, whole, np.int32(count)))
    residuals = missed_by(fine, angles, at)
    kept = all(by <= tolerated(fine, name) for name, by in residuals.items())
    return Fine(value, float(np.max(np.diff(fine.x))), kept, residuals)


def _between(rows: np.ndarray, factor: int) -> np.ndarray:
    """Numbers at waypoints [K, ...] and evenly between them, [(K - 1) factor + 1, ...]."""
    share = np.arange(factor).reshape(-1, *[1] * (rows.ndim - 1)) / factor
    inner = rows[:-1, None] + share * (rows[1:] - rows[:-1])[:, None]
    return np.concatenate([inner.reshape(-1, *rows.shape[1:]), rows[-1:]])


@jax.jit
def _value(criterion: Criterion | Weighted, at: Station, count: Int[Array, ""]) -> Float[Array, ""]:
    """The criterion's value over the first `count` stations, the last of which is repeated;
    infinite where numbers are not finite."""

    def single(criterion: Criterion) -> Array:
        if criterion.kind == "max":
            return largest(station_cost(criterion, at), 0)
        cost = step_cost(criterion, *steps(at))
        return jnp.sum(jnp.where(jnp.arange(len(cost), dtype=jnp.int32) < count - 1, cost, 0))

    if isinstance(criterion, Weighted):
        parts = [jnp.asarray(weight, float) * single(part) for part, weight in criterion.parts]
        value = jnp.sum(jnp.stack(parts))
    else:
        value = single(criterion)
    return jnp.where(jnp.all(at.finite) & jnp.isfinite(value), value, jnp.inf)


def result_at(problem: PostureProblem, x: Float[np.ndarray, "n"], **others: Any) -> PostureResult:
    """See Problem.result."""
    x = np.array(x, dtype=float).reshape(-1)
    fine = evaluate_finer(problem, x)
    return problem.result(
        x,
        fine_value=fine.value,
        fine_spacing=fine.spacing,
        fine_feasible=fine.feasible,
        fine_residuals=fine.residuals,
        **others,
    )
