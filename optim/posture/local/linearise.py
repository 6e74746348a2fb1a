"""A posture problem near a point, and the points to begin from.

The criteria are outer functions (sum of positive parts, sum of squares, largest) of smooth terms,
and each term depends on the leg angles of one waypoint or of two neighbours, so that two
directional derivatives of all stations at once give the whole sparse Jacobian.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_choice
from stickslip.optim.options import float64_program
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import Criterion, Weighted, steps
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.station import Station
from stickslip.optim.result import OptimStatus

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

    @property
    def shortfall(self) -> float:
        """Sum of the violated margins."""
        return sum(float(np.sum(np.maximum(-of, 0))) for of in self.margins.values())


class Near:
    """Linear models of a problem in float64, remembering the last point; counts evaluations."""

    def __init__(self, problem: PostureProblem):
        self.problem, self.evaluations = problem, 0
        parts = parts_of(problem.criterion)
        self.criteria = [one for one, _ in parts]
        self.weights = [float(weight) for _, weight in parts]
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
        rows = self.problem.waypoints.stations(angles, sloped=True)
        terms, term_slopes, placed = linear_terms(self.problem.posture.criterion, rows)
        margins, slopes = evaluate.margins_and_slopes(self.problem.limits, rows)
        # In SMOOTH's order, which a solver's last digits depend on.
        names = [name for name in SMOOTH if name in margins]
        kept = [{name: of[name] for name in names} for of in (margins, slopes)]
        return Linear(terms, term_slopes, kept[0], kept[1], placed)

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


def parts_of(criterion: Criterion | Weighted) -> list[tuple[Criterion, Any]]:
    """The single criteria of a criterion, and their weights."""
    return list(criterion.parts) if isinstance(criterion, Weighted) else [(criterion, 1.0)]


def outer(criterion: Criterion, terms: np.ndarray) -> float:
    """The criterion's value, from all its terms."""
    if criterion.kind == "max":
        return float(np.max(terms))
    return float(np.sum(terms**2 if criterion.outer == "square" else np.maximum(terms, 0)))


@float64_program
def linear_terms(criterion: Criterion | Weighted, rows: Float[jax.Array, "rows K"]):
    """Terms of each criterion and their slopes, as in Linear, and whether all terms are finite.

    rows: the stations with their slopes, packed.
    """
    at, slopes = Station.unpacked_with_slopes(rows)
    numbers = at._replace(status=jnp.zeros_like(at.torque))
    each = jax.tree.map(lambda of: jnp.moveaxis(of, -1, 0), slopes)
    none = jax.tree.map(lambda of: jnp.zeros_like(of[:, 1:]), each)
    begin = jax.tree.map(lambda of, zero: jnp.concatenate([of[:, :-1], zero]), each, none)
    end = jax.tree.map(lambda of, zero: jnp.concatenate([zero, of[:, 1:]]), each, none)
    pushed = [
        _pushed(single.terms, steps(numbers), (begin, end))
        if single.kind == "sum"
        else _pushed(single.terms, (numbers,), (each,))
        for single, _ in parts_of(criterion)
    ]
    terms, term_slopes = map(list, zip(*pushed, strict=True))
    finite = jnp.stack([jnp.all(jnp.isfinite(of)) for of in terms])
    return terms, term_slopes, jnp.all(at.placed & at.finite) & jnp.all(finite)


def _pushed(function, at: tuple[Station, ...], each: tuple[Station, ...]):
    """The function's value, and its slopes in each direction as a new last axis; 0 where not
    finite."""
    slopes = jax.vmap(lambda *d: jax.jvp(function, at, d)[1], out_axes=-1)(*each)
    return function(*at), jax.tree.map(lambda v: jnp.where(jnp.isfinite(v), v, 0), slopes)


STARTS = ("dp", "grid", "middle")


def start_point(
    problem: PostureProblem, start: Any, angles: Any = None, progress: bool = False
) -> tuple[Float[np.ndarray, "n"], str]:
    """A point to begin from, inside the bounds, and a sentence where it is not what was asked for.

    start: "dp" or "grid", those methods' solutions on the grid of those angles (see build_grid);
    "middle", the middle of the legs' range everywhere; or a decision vector. Where the grid has no
    feasible path, or the criterion is a weighted sum that dp does not take, it is the middle.
    """
    low, high = problem.bounds
    if not isinstance(start, str):
        return np.clip(problem.angles(start).reshape(-1), low, high), ""
    require_choice("start", start, STARTS)
    middle = (low + high) / 2
    if start == "middle":
        return middle, ""
    from stickslip.optim.problem import solve

    if start == "dp" and problem.criterion.kind == "mixed":
        return middle, "began in the middle: dp takes no weighted sum with a worst station in it; "
    found = solve(problem, start, polish=False, progress=progress, angles=angles)
    if found.x is None:
        return middle, f"began in the middle, since {start} found nothing ({found.message}); "
    return np.clip(found.x, low, high), ""


def within_rates(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> np.ndarray | None:
    """x, or a point near it within the bounds and the leg rates; None if there is none."""
    angles = problem.angles(x).copy()
    low, high = (side.reshape(-1, 2).copy() for side in problem.bounds)
    most = np.full(len(low) - 1, np.inf)
    if problem.leg_rate is not None:
        most = problem.leg_rate * np.diff(problem.x) * (1 + 1e-9)
    for k, move in reversed(list(enumerate(most))):  # from where the rest can be reached
        low[k] = np.maximum(low[k], low[k + 1] - move)
        high[k] = np.minimum(high[k], high[k + 1] + move)
    for k in range(len(low)):
        if k:
            low[k] = np.maximum(low[k], angles[k - 1] - most[k - 1])
            high[k] = np.minimum(high[k], angles[k - 1] + most[k - 1])
        if np.any(low[k] > high[k]):
            return None
        angles[k] = np.clip(angles[k], low[k], high[k])
    return angles.reshape(-1)


def begin(
    problem: PostureProblem, method: str, start: Any, angles: Any, progress: bool, began: float
) -> tuple[Near, Float[np.ndarray, "n"], str] | PostureResult:
    """Start of a method: the problem's linear models, a point within bounds and leg rates, and
    start_point's sentence. Or the result, where there is no such point, no pose at it, or no
    choice."""
    x, note = start_point(problem, start, angles, progress)
    x = within_rates(problem, x)
    if x is None:
        return PostureResult.without_point(
            method=method, status=OptimStatus.INFEASIBLE, began=began,
            message="leg_rate lets no path lead from start_angles to end_angles in this range",
        )  # fmt: skip
    if problem.free.n == 0:
        message = f"{note}every angle is given{problem.shortcomings(x)}"
        common: dict[str, Any] = {"method": method, "began": began, "evaluations": 1}
        return problem.result(x, status=OptimStatus.FEASIBLE, message=message, **common)
    near = Near(problem)
    if near(x).placed:
        return near, x, note
    message = f"{note}where it begins there is no pose, or no forces{problem.shortcomings(x)}"
    return problem.result(x, method=method, status=OptimStatus.FAILED, began=began, message=message)
