"""A posture problem near a point: its smooth terms and margins with their slopes, in blocks.

Every method that follows slopes works with this: the criteria are outer functions (sum of positive
parts, sum of squares, largest) of smooth terms, and each term depends on the leg angles of one
waypoint or of two neighbours, so that two directional derivatives of all stations at once give the
whole sparse Jacobian.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.posture.criteria import Criterion, Weighted, steps
from stickslip.optim.posture.stations import evaluated, traced
from stickslip.optim.posture.stations.station import Station

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.posture.problem import PostureProblem

SMOOTH = ("grip", "normal", "clearance", "wheels", "torque")
"""The constraints that have slopes. leg_rate is linear; pose is a yes or no."""


class Linear(NamedTuple):
    """Values and slopes at one point; one entry of terms and term_slopes for each criterion.

    terms: [K-1, m] of sums over steps, [K, m] of worst stations. term_slopes: [K-1, m, 4] in the
    rear and front angle where the step begins, then where it ends; [K, m, 2] of stations. margins,
    margin_slopes: by name, [K, m] and [K, m, 2], satisfied where >= 0. placed: whether the vehicle
    has a pose at every waypoint, and all terms are finite.
    """

    terms: list[Float[np.ndarray, "rows m"]]
    term_slopes: list[Float[np.ndarray, "rows m d"]]
    margins: dict[str, Float[np.ndarray, "K m"]]
    margin_slopes: dict[str, Float[np.ndarray, "K m 2"]]
    placed: np.ndarray


class Near:
    """Linear models of a problem in float64, remembering the last point; counts evaluations."""

    def __init__(self, problem: PostureProblem):
        self.problem, self.evaluations = problem, 0
        self._shared = without_criterion(problem)
        self.criteria = criteria_of(problem.criterion)
        self.weights = weights_of(problem.criterion)
        self._at: np.ndarray | None = None
        self._linear: Linear | None = None

    def __call__(self, x: Float[np.ndarray, "n"]) -> Linear:
        """The linear model at x [2K], as NumPy arrays."""
        if self._linear is None or self._at is None or not np.array_equal(x, self._at):
            self._linear = self._linearised(self.problem.angles(x))
            self._at = np.array(x)
            self.evaluations += 1
        return self._linear

    def _linearised(self, angles: np.ndarray) -> Linear:
        with jax.enable_x64(True):
            posture = self._shared
            at, slopes = evaluated.stations_and_slopes(posture, angles)
            terms = linear_terms(self.problem.posture.criterion, at, slopes)
            terms, term_slopes, placed = jax.tree.map(np.asarray, terms)
            margins = _smooth(traced.constraints(posture, at, angles))
            margin_slopes = _smooth(traced.margin_slopes(posture, at, slopes))
        return Linear(terms, term_slopes, margins, margin_slopes, placed)

    def value(self, at: Linear) -> float:
        """The objective, from the terms; infinite where there is none."""
        if not at.placed:
            return np.inf
        each = zip(self.criteria, self.weights, at.terms, strict=True)
        return float(sum(weight * outer(one, terms) for one, weight, terms in each))

    def scale(self, at: Linear) -> float:
        """A positive size of the objective near there, to divide it by."""
        each = zip(self.criteria, self.weights, at.terms, strict=True)
        small = max(w * outer(one, np.abs(terms)) for one, w, terms in each)
        value = self.value(at)
        return max(abs(value) if np.isfinite(value) else 0.0, 1e-3 * small, 1e-12)


def _smooth(margins: dict[str, jax.Array]) -> dict[str, np.ndarray]:
    """Those with slopes, in SMOOTH's order, which a solver's last digits depend on."""
    return {name: np.asarray(margins[name]) for name in SMOOTH if name in margins}


def without_criterion(problem: PostureProblem) -> traced.Posture:
    """The posture for what is the same by every criterion, so that all share compiled programs."""
    return replace(problem.posture, criterion=None)


def criteria_of(criterion: Criterion | Weighted) -> list[Criterion]:
    """The single criteria of a criterion."""
    return [one for one, _ in criterion.parts] if isinstance(criterion, Weighted) else [criterion]


def weights_of(criterion: Criterion | Weighted) -> list[float]:
    """Their weights."""
    return [float(w) for _, w in criterion.parts] if isinstance(criterion, Weighted) else [1.0]


def outer(criterion: Criterion, terms: np.ndarray) -> float:
    """The criterion's value, from all its terms."""
    if criterion.kind == "max":
        return float(np.max(terms))
    return float(np.sum(terms**2 if criterion.outer == "square" else np.maximum(terms, 0)))


@jax.jit
def linear_terms(criterion: Criterion | Weighted, at: Station, slopes: Station):
    """Terms of each criterion and their slopes, as in Linear, and whether all terms are finite.

    slopes: of the stations in their own two angles, a last axis of 2.
    """
    numbers = at._replace(status=jnp.zeros_like(at.torque))
    each = jax.tree.map(lambda of: jnp.moveaxis(of, -1, 0), slopes)
    none = jax.tree.map(lambda of: jnp.zeros_like(of[:, 1:]), each)
    begin = jax.tree.map(lambda of, zero: jnp.concatenate([of[:, :-1], zero]), each, none)
    end = jax.tree.map(lambda of, zero: jnp.concatenate([zero, of[:, 1:]]), each, none)
    pushed = [
        _pushed(single.terms, steps(numbers), (begin, end))
        if single.kind == "sum"
        else _pushed(single.terms, (numbers,), (each,))
        for single in criteria_of(criterion)
    ]
    terms, term_slopes = map(list, zip(*pushed, strict=True))
    finite = jnp.stack([jnp.all(jnp.isfinite(of)) for of in terms])
    return terms, term_slopes, jnp.all(at.placed & at.finite) & jnp.all(finite)


def _pushed(function, at: tuple[Station, ...], each: tuple[Station, ...]):
    """The function's value, and its slopes in each direction as a new last axis; 0 where not
    finite."""
    slopes = jax.vmap(lambda *d: jax.jvp(function, at, d)[1], out_axes=-1)(*each)
    return function(*at), jax.tree.map(lambda v: jnp.where(jnp.isfinite(v), v, 0), slopes)
