"""Sequential convex programming: convexify about a point, solve, repeat.

The objective is a convex outer function (sum of positive parts, sum of squares, largest) of smooth
terms, each of the leg angles of one waypoint or of two neighbours, so that two directional
derivatives of all stations at once give the whole sparse Jacobian J. Replacing terms and margins by
their linear models leaves a convex program,

    minimise outer(c + J step) / scale + penalty * (what the linear margins are missed by)

over steps within a box, the bounds and the leg rates. The box shrinks where the model was wrong and
grows where it was right.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, NamedTuple

import cvxpy as cp
import jax
import jax.numpy as jnp
import numpy as np
import scipy.sparse as sp

from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.dynamics.pytrees import float64_program
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import Criterion, Station, paid, steps
from stickslip.optim.posture.evaluate import PostureResult, each_angle, pushed
from stickslip.optim.posture.waypoints import CONVEX
from stickslip.optim.problem import COUNT, FEASIBLE, OptimStatus, require_scalar, solve_quietly
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.optim.posture.problem import PostureProblem

SMOOTH = ("grip", "normal", "clearance", "wheels", "torque")
"""The constraints that have slopes. leg_rate is linear; pose is a yes or no."""


class Linear(NamedTuple):
    """The objective and its linear model at one point.

    value: infinite where the vehicle has no pose or no forces. terms: [K-1, m] of sums over steps,
    [K, m] of worst stations. term_slopes: [K-1, m, 4] in the rear and front angle where the step
    begins, then where it ends; [K, m, 2] of stations. margins, margin_slopes: by name, [K, m] and
    [K, m, 2], satisfied where >= 0.
    """

    value: float
    terms: Float[np.ndarray, "rows m"]
    term_slopes: Float[np.ndarray, "rows m d"]
    margins: dict[str, Float[np.ndarray, "K m"]]
    margin_slopes: dict[str, Float[np.ndarray, "K m 2"]]

    @property
    def shortfall(self) -> float:
        return sum(float(np.sum(np.maximum(-of, 0))) for of in self.margins.values())


def linearised(problem: PostureProblem, x: Float[np.ndarray, "n"]) -> Linear:
    """The linear model at x [2K], in float64."""
    both, criterion = problem.waypoints.sloped(problem.angles(x)), problem.posture.criterion
    terms, term_slopes, sound = linear_terms(criterion, *both)
    margins, slopes = evaluate.margins_and_slopes(problem.limits, *both)
    # In SMOOTH's order, which a solver's last digits depend on.
    names = [name for name in SMOOTH if name in margins]
    kept = [{name: of[name] for name in names} for of in (margins, slopes)]
    value = float(outer(criterion, terms)) if sound else np.inf
    return Linear(value, terms, term_slopes, *kept)


@float64_program
def outer(criterion: Criterion, terms: Float[Array, "rows m"]) -> Float[Array, ""]:
    """The criterion's value, from all its terms."""
    return jnp.max(terms) if criterion.kind == "max" else jnp.sum(paid(criterion, terms))


@float64_program
def linear_terms(criterion: Criterion, at: Station, slopes: Station):
    """Terms and their slopes, as in Linear, and whether there are poses and finite terms."""
    each = each_angle(slopes)
    none = jax.tree.map(lambda of: jnp.zeros_like(of[:, 1:]), each)
    begin = jax.tree.map(lambda of, zero: jnp.concatenate([of[:, :-1], zero]), each, none)
    end = jax.tree.map(lambda of, zero: jnp.concatenate([zero, of[:, 1:]]), each, none)
    if criterion.kind == "sum":
        terms, term_slopes = pushed(criterion.terms, steps(at), (begin, end))
    else:
        terms, term_slopes = pushed(criterion.terms, (at,), (each,))
    return terms, term_slopes, jnp.all(at.placed & at.finite) & jnp.all(jnp.isfinite(terms))


def within_rates(problem: PostureProblem, x: np.ndarray, slack: float = 0.0) -> np.ndarray | None:
    """x, or a point near it within the bounds and the leg rates; None if there is none."""
    angles = problem.angles(x).copy()
    low, high = np.reshape(problem.bounds, (2, -1, 2)) + slack * np.array([[[-1]], [[1]]])
    most = problem.longest_moves * (1 + 1e-9 + slack)
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


def solve_model(
    problem: PostureProblem, x: np.ndarray, at: Linear, scale: float, radius: float, penalty: float
) -> tuple[np.ndarray, float] | None:
    """The best step [2K] within the box of that radius [rad] about x, and the merit that the model
    promises there; None where the solver gave up. scale: the objective's size."""
    low, high = problem.bounds
    step = cp.Variable(problem.n)
    low, high = np.maximum(low - x, -radius), np.minimum(high - x, radius)
    constraints: list[cp.Constraint] = [step >= low, step <= high]
    square = problem.criterion.outer == "square"
    factor = np.sqrt(scale) if square else scale
    terms = np.ravel(at.terms) / factor + _sparse(at.term_slopes / factor, problem.n) @ step
    if problem.criterion.kind == "max":
        goal = cp.max(terms)
    elif (rates := problem.posture.criterion.rates) is not None:
        up, down = (np.tile(of, len(at.terms)) for of in rates)
        goal = cp.sum(cp.maximum(cp.multiply(up, terms), cp.multiply(down, terms)))
    else:
        goal = cp.sum((cp.square if square else cp.pos)(terms))
    for name, margins in at.margins.items():
        slack = cp.Variable(margins.size, nonneg=True)
        model = np.ravel(margins) + _sparse(at.margin_slopes[name], problem.n) @ step
        constraints.append(model + slack >= 0)
        goal += penalty * cp.sum(slack)
    if problem.leg_rate is not None:
        most = np.repeat(problem.longest_moves, 2)
        moves = step[2:] - step[:-2] + (x[2:] - x[:-2])
        constraints += [moves <= most, moves >= -most]
    model = cp.Problem(cp.Minimize(goal), constraints)
    if not solve_quietly(model).answered:
        return None
    return np.asarray(step.value), float(np.asarray(model.value))


def _sparse(slopes: Float[np.ndarray, "rows m d"], n: int) -> sp.csr_array:
    """Slopes of each waypoint's terms in its own angles, and maybe the next one's, as a matrix."""
    rows, m, d = slopes.shape
    columns = np.broadcast_to(2 * np.arange(rows)[:, None, None] + np.arange(d), slopes.shape)
    ends = d * np.arange(rows * m + 1)
    return sp.csr_array((np.ravel(slopes), np.ravel(columns), ends), shape=(rows * m, n))


SMALLEST = 1e-7
"""Half of the smallest box [rad]."""
PENALTIES = (10.0, 1e3, 1e5)
"""Penalties of violated margins, in this order: of the objective's scale for a whole weight."""
MISSED = 1e-7
"""Largest scaled violation that needs no higher penalty."""
GOOD, BAD, TAKEN = 0.75, 0.25, 0.01
"""Shares of the predicted decrease: above GOOD the box grows, below BAD it shrinks, below TAKEN
the step is refused."""


def solve_scp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    start: Any = None,
    iterations: int = 60,
    radius: float = 0.2,
    tolerance: float = 1e-7,
) -> PostureResult:
    """A local optimum off the grid, from `start`, a decision vector; None: dp's path.

    iterations: of all prices together. radius: the first box [rad]. It stops where the model
    predicts a decrease below `tolerance`, relative to the merit, or where the box is below
    SMALLEST [rad]. Margins are kept by an exact penalty with rising price; bounds and leg rates,
    which are linear, exactly.

    Nothing is proved of the value: FEASIBLE, LIMIT after `iterations`, VIOLATED, INACCURATE where
    the solver failed to the end, FAILED without a pose to begin. evaluations: linearisations.
    details: steps (iterations), predicted (the last relative decrease that the model promised).
    """
    began = time.perf_counter()
    for name, value in (("radius", radius), ("tolerance", tolerance)):
        require_scalar(name, value, low=0.0, strict=True, accepted="a number > 0")
    iterations = require_integer("iterations", iterations, low=0, high=COUNT)
    K = len(problem.x)
    require_memory(f"method = 'scp' with {K} waypoints", "rows", K, CONVEX)
    begun = problem.begin("scp", start, progress, began)
    if isinstance(begun, PostureResult):
        return begun
    x, note = within_rates(problem, begun[0]), begun[2]
    if x is None:
        near = within_rates(problem, begun[0], FEASIBLE) is not None
        status = OptimStatus.FAILED if near else OptimStatus.INFEASIBLE
        return PostureResult.without_point(
            method="scp", status=status, began=began,
            message="leg_rate lets no path lead from start_angles to end_angles in this range",
        )  # fmt: skip
    search = _Search(problem, x, tolerance)
    if not np.isfinite(search.at.value):
        message = f"{note}where it begins there is no pose, or no forces{problem.shortcomings(x)}"
        status = OptimStatus.FAILED
        return problem.result(x, method="scp", status=status, began=began, message=message)
    with Bar("scp", iterations, "step", progress) as bar:
        for penalty in PENALTIES:
            search.penalty, search.radius, search.predicted = penalty, radius, np.inf
            while search.steps < iterations and not search.settled:
                search.step()
                bar.advance(note=f"{search.at.value:.6g}")
            if all(np.min(of) >= -MISSED for of in search.at.margins.values()):
                break
    status, why = search.ended()
    return problem.result(
        search.x,
        method="scp",
        began=began,
        status=status,
        evaluations=search.evaluations,
        message=f"{note}{why} after {search.steps} steps, the model promising a relative "
        f"decrease of {search.predicted:.3g}{problem.shortcomings(search.x)}",
        details={"steps": search.steps, "predicted": search.predicted},
    )


class _Search:
    """A point, its linear model and a box about it; tolerance: see solve_scp."""

    def __init__(self, problem: PostureProblem, x: np.ndarray, tolerance: float):
        self.problem, self.x, self.tolerance = problem, x, tolerance
        self.at, self.evaluations = linearised(problem, x), 1
        small = float(outer(problem.posture.criterion, np.abs(self.at.terms)))
        self.scale = max(abs(self.at.value), 1e-3 * small, 1e-12)
        self.penalty = self.radius = 0.0
        self.predicted, self.steps, self.failed = np.inf, 0, False

    @property
    def settled(self) -> bool:
        return self.predicted <= self.tolerance or self.radius < SMALLEST

    def ended(self) -> tuple[OptimStatus, str]:
        if not self.settled:
            return OptimStatus.LIMIT, "stopped"
        if self.predicted <= self.tolerance:
            return OptimStatus.FEASIBLE, "stationary"
        status = OptimStatus.INACCURATE if self.failed else OptimStatus.FEASIBLE
        return status, "no step in the smallest box helped"

    def merit(self, at: Linear) -> float:
        """Scaled objective and penalty; infinite where the vehicle has no pose."""
        return at.value / self.scale + self.penalty * at.shortfall

    def step(self) -> None:
        """Solve the model, take or refuse its step, and adapt the box."""
        solution = solve_model(self.problem, self.x, self.at, self.scale, self.radius, self.penalty)
        self.steps += 1
        self.failed = solution is None
        if solution is None:
            self.radius /= 4
            return
        step, promised = solution
        tried = np.clip(self.x + step, *self.problem.bounds)
        there = linearised(self.problem, tried)
        self.evaluations += 1
        before, after = self.merit(self.at), self.merit(there)
        predicted = max(before - promised, 0.0)
        self.predicted = predicted / max(before, 1.0)
        share = (before - after) / max(predicted, 1e-300)
        if share > TAKEN:
            self.x, self.at = tried, there
        if share < BAD:
            self.radius = min(self.radius, float(np.max(np.abs(step)))) / 3
        elif share > GOOD:
            self.radius *= 2
