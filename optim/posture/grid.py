"""Methods over every pair of leg angles at every waypoint: `grid`, the chapter's choice of each
waypoint by itself, and `dp`, the best path.

Costs of arriving, y, are potentials: y_head <= y_tail + cost for every edge, so no path costs less
than y at its end. That is the dual of the shortest path, without a linear program.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_memory
from stickslip.dynamics.pytrees import float64_program
from stickslip.dynamics.status import Status
from stickslip.optim.posture import criteria
from stickslip.optim.posture.evaluate import PostureResult, below, natural
from stickslip.optim.posture.layers import CHUNK, Layer, Layers, shortfall
from stickslip.optim.posture.waypoints import (
    CONVEX,
    LEAST,
    MOVE,
    ROUNDING,
    grid_angles,
    step_of,
    windows_of,
)
from stickslip.optim.problem import OptimStatus
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.optim.posture.problem import PostureProblem

BETTER = 1e-9
"""Relative decrease below which a polished drive is no better than the grid's."""


@dataclass(frozen=True)
class PostureGrid:
    """The stations of K waypoints and N pairs of angles, as NumPy arrays.

    began: time of the start. rear, front: the angles of each leg [rad]; the pairs are all of one
    with all of the other, the front leg's running faster. layers: the choices at each waypoint, in
    `Layers`; one, which need not lie on the grid, where the first or the last pair is given.
    method: that searches it.
    """

    problem: PostureProblem
    began: float
    rear: Float[np.ndarray, "R"]
    front: Float[np.ndarray, "F"]
    pairs: Float[np.ndarray, "N 2"]
    layers: Sequence[Layer]
    method: str

    @property
    def shape(self) -> tuple[int, int]:
        return len(self.rear), len(self.front)

    @property
    def what(self) -> str:
        """The set of drives that is searched, in words."""
        given = {"start": self.problem.start_angles, "end": self.problem.end_angles}
        text = f"paths over the {self.shape[0]} x {self.shape[1]} grid of leg angles"
        ends = [name for name, at in given.items() if at is not None]
        return text + (f" with the given {' and '.join(ends)}" if ends else "")

    @cached_property
    def windows(self) -> Int[np.ndarray, "steps 2"]:
        """Grid steps that the rear and the front leg may move in each step."""
        limits = self.problem.longest_moves
        return np.stack([windows_of(angles, limits) for angles in (self.rear, self.front)], -1)

    @property
    def stuck(self) -> str:
        """A sentence on steps in which the rate lets no leg reach its next angle; or nothing."""
        counts = np.array(self.shape)
        none = np.all((self.windows == 0) | (counts == 1), axis=1) & np.any(counts > 1)
        if not np.any(none):
            return ""
        gap = min(step_of(of) for of in (self.rear, self.front) if len(of) > 1)
        longest = np.min(self.problem.longest_moves[none])
        return (
            f"In {int(np.sum(none))} of {len(none)} steps no leg can move on the grid: its angles "
            f"are {gap:.4g} rad apart and leg_rate allows {longest:.4g} rad; "
            "more angles or wider spacing of the waypoints would let them."
        )

    def choices(self, k: int) -> Float[np.ndarray, "n 2"]:
        """Leg angles of the nodes of waypoint k [rad]."""
        given = self.problem.given_at(k)
        return self.pairs if given is None else given[None]

    def angles_at(self, nodes: Sequence[int]) -> Float[np.ndarray, "K 2"]:
        """Leg angles of a choice at each waypoint [rad]."""
        return np.stack([self.choices(k)[node] for k, node in enumerate(nodes)])

    def moves(self, step: int) -> Int[np.ndarray, "moves 2"]:
        """Moves of the rear and the front leg in a step, in grid steps, the shortest first; filled
        up to a power of two with moves beyond the grid, so that few programs are compiled."""
        rear, front = self.windows[step].tolist()
        given = f"leg_rate = {self.problem.leg_rate} rad/m on this grid"
        require_memory(given, "moves", (2.0 * rear + 1) * (2.0 * front + 1), MOVE)
        both = np.mgrid[-rear : rear + 1, -front : front + 1].reshape(2, -1).T
        both = both[np.argsort(np.sum(np.abs(both), axis=1), kind="stable")]
        size = 1 << (len(both) - 1).bit_length()
        beyond = np.tile(self.shape, (size - len(both), 1))
        return np.concatenate([both, beyond]).astype(np.int32)

    def near(self, step: int) -> Bool[np.ndarray, "tails heads"]:
        """Mask of the moves of a step from or to a given pair."""
        a, b = (self.choices(k) for k in (step, step + 1))
        longest = self.problem.longest_moves[step] * (1 + ROUNDING)
        return np.max(np.abs(b - a[:, None]), -1) <= longest

    def why_stuck(self, k: int) -> str:
        """Text of why no path reaches waypoint k, where one reaches k - 1."""
        met, good = self.layers[k].met, self.layers[k].admissible
        if not np.any(good):
            broken = {name: int(np.sum(~of)) for name, of in met.items() if not np.all(of)}
            each = ", ".join(f"{name} rules out {n} of {len(good)}" for name, n in broken.items())
            where = f"at waypoint {k} (x = {self.problem.x[k]:.6g} m)"
            return f"{where} no pair of angles meets all constraints: {each}"
        if k == 0:
            return ""
        if self.problem.leg_rate is None:
            return f"the criterion is not finite at waypoint {k} on any of them"
        return (
            f"leg_rate = {self.problem.leg_rate} rad/m lets none of the pairs that are reached at "
            f"waypoint {k - 1} move to an admissible one at waypoint {k} "
            f"(x = {self.problem.x[k]:.6g} m) on this grid. {self.stuck}"
        ).rstrip()

    def result(self, nodes: Sequence[int], message: str, **details: Any) -> PostureResult:
        """The result of a path. details: besides the number of angles of each leg."""
        return self.problem.result(
            self.angles_at(nodes),
            status=OptimStatus.FEASIBLE,
            message=message,
            details={"grid": self.shape} | details,
            **self._common,
        )

    @property
    def _common(self) -> dict[str, Any]:
        count = sum(len(self.choices(k)) for k in range(len(self.layers)))
        return {"method": self.method, "began": self.began, "evaluations": count}

    def without_path(self, k: int, progress: bool) -> PostureResult:
        """The result where paths lead to waypoint k - 1, none to k. details: see `shortfall`.

        INFEASIBLE where the problem leaves one pair of angles at k, and that breaks a constraint.
        Else FAILED: there are angles off the grid, and a posture that ends in a numerical status
        (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is not known to be impossible.
        """
        layer, reason = self.layers[k], self.why_stuck(k)
        unplaced = ~layer.met["pose"]
        status, message = OptimStatus.FAILED, f"no {self.what}: {reason}"
        if np.any(unplaced):
            codes = layer.stations.status[unplaced]
            codes = np.where(np.isin(codes, criteria.PLACED), int(Status.NON_FINITE), codes)
            counts = Counter(Status(int(code)).name for code in codes)
            listed = ", ".join(f"{n} {name}" for name, n in counts.most_common())
            what = "hollow ground" if set(counts) == {"HOLLOW_GROUND"} else "no pose"
            message += f"; {what}: {len(codes)} of {unplaced.size} pairs of angles there ended "
            message += listed
            if "HOLLOW_GROUND" in counts:
                message += "; read_track(envelope=RADIUS), or --ground envelope, fills hollows"
        elif len(unplaced) == 1 and not layer.admissible[0]:
            status, message = OptimStatus.INFEASIBLE, f"infeasible: {reason}"
        return PostureResult.without_point(
            status=status, message=message, details=shortfall(self, progress), **self._common
        )


def build_grid(problem: PostureProblem, angles: Any, least: int, method: str = "dp") -> PostureGrid:
    """The grid, whose stations are evaluated in float64 when they are asked for.

    angles: how many for each leg, evenly spaced over its range, an integer or a pair; or None for
    `fitting_grid`, with `least` of each leg.
    """
    began = time.perf_counter()
    rear, front = grid_angles(problem, angles, least, CHUNK)
    pairs = np.stack(np.meshgrid(rear, front, indexing="ij"), -1).reshape(-1, 2)
    return PostureGrid(problem, began, rear, front, pairs, Layers(problem, pairs), method)


AGREEMENT, NOTHING = 1e-8, 1e-12
"""Relative differences of the recursion's value and the objective above which it is no proof: to
the value, or, where that is near 0, to what the vehicle's weight would give."""


def solve_grid(
    problem: PostureProblem, *, progress: bool = False, angles: Any = None, least: int = LEAST
) -> PostureResult:
    """Choose at each waypoint the admissible pair of leg angles whose own cost is least.

    The chapter's search. A worst-station criterion is judged by the station's cost; of sums over
    steps, wheel_energy and total_energy by |M|, torque_variation by |M - M'|, M' being the choice
    before (0 at the first waypoint). angles, least: of the grid, as in dp. leg_rate is not looked
    at, as in the chapter, and the result may break it (VIOLATED). evaluations: stations. details:
    grid, grid_bound (of worst stations the largest over the waypoints of the least cost there, a
    bound on paths over the grid; None for sums).
    """
    grid, criterion = build_grid(problem, angles, least, "grid"), problem.criterion
    before = grid.layers[0].stations.map(lambda of: np.zeros_like(of[:1]))
    nodes: list[int] = []
    bound = -np.inf
    with Bar("grid", len(grid.layers), "waypoint", progress) as bar:
        for k, layer in enumerate(grid.layers):
            if not np.any(layer.admissible):
                return grid.without_path(k, progress)
            cost = _pointwise(criterion, layer.stations, before)
            cost = np.where(layer.admissible, cost, np.inf)
            bound = max(bound, float(np.min(cost)))
            nodes.append(int(np.argmin(cost)))
            before = layer.stations.map(lambda of: of[[nodes[-1]]])
            bar.advance()
    known = below(problem, bound) if criterion.kind == "max" else None
    return grid.result(nodes, "chosen point by point, leg_rate not looked at", grid_bound=known)


@float64_program
def _pointwise(
    criterion: criteria.Criterion, a: criteria.Station, before: criteria.Station
) -> Float[Array, "..."]:
    """Cost of a station judged alone: its own, or `pointwise` where the criterion is a sum."""
    if criterion.pointwise is None:
        return criteria.station_cost(criterion, a)
    return criterion.pointwise(a, before)


def solve_dp(
    problem: PostureProblem,
    *,
    progress: bool = False,
    polish: bool = False,
    angles: Any = None,
    least: int = LEAST,
) -> PostureResult:
    """The exact optimum over paths on a grid of leg angles, evenly spaced for each leg.

    angles: of each leg, an integer or a pair, evenly spaced over its range; None: those of
    fitting_grid, `least` of each leg at least. polish: see `_polished`.

    Value iteration forwards over the waypoints: V_k(j) = min over i of V_(k-1)(i) + cost(i, j) for
    criteria that are sums over steps, V_k(j) = min over i of max(V_(k-1)(i), cost(j)) for worst
    stations; i runs over the pairs of angles from which the rate lets both legs arrive. Time:
    K n^2 w^2, w being the angles within reach; without a rate limit w is n: keep the grid coarse.

    Given start and end angles are nodes of their own, on the grid or not. The grid's bound is the
    value less its rounding and that of the stations (`below`); it bounds no drive off the grid.
    INACCURATE where the objective is not within 1e-8 of the value, nor within 1e-12 of what the
    vehicle's weight would give. FAILED where there is no path over the grid: see `without_path`.
    evaluations: stations. details: grid, grid_bound, edges (moves looked at).
    """
    K = len(problem.x)
    if polish:
        require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)
    grid = build_grid(problem, angles, least)
    costs, back, edges, size = _arrivals(grid, progress)
    if not np.any(np.isfinite(costs)):
        return grid.without_path(len(back), progress)
    message = grid.stuck or f"proved: the best of all {grid.what}, not of all drives"
    rounding = 4 * np.finfo(float).eps * size * (K + 1)
    bound = below(problem, float(np.min(costs)) - rounding)
    nodes = [int(np.argmin(costs))]
    for came in back[::-1]:
        nodes.append(int(came[nodes[-1]]))
    found = grid.result(nodes[::-1], message, grid_bound=bound, edges=edges)
    found = _agreed(problem, found, float(np.min(costs)))
    return _polished(problem, found, progress) if polish else found


def _polished(problem: PostureProblem, grid: PostureResult, progress: bool) -> PostureResult:
    """The better of the grid's path and of the local optimum that scp finds from it.

    details: those of the grid, whose grid_bound a drive off it may be below; grid_value and
    grid_angles, of the grid's path; polish, how scp ended.
    """
    from stickslip.optim.posture.scp import solve_scp

    local = solve_scp(problem, start=grid.x, progress=progress)
    details = dict(grid.details) | {
        "grid_value": grid.value,
        "grid_angles": grid.leg_angles,
        "polish": f"{local.status.name}: {local.message}",
    }
    seconds = grid.seconds + local.seconds
    least = grid.value - BETTER * (1 + abs(grid.value))
    if not local.feasible or (grid.feasible and not local.value < least):
        return replace(grid, details=details, seconds=seconds)
    stuck = f" {grid.message}" if grid.message.startswith("In ") else ""
    return replace(
        local,
        method=grid.method,
        status=OptimStatus.FEASIBLE,
        evaluations=grid.evaluations,
        seconds=seconds,
        message=f"a local optimum off the grid, by scp ({local.message}), from the grid's path, "
        f"whose value is {grid.value:.8g}.{stuck}",
        details=details,
    )


def _agreed(problem: PostureProblem, result: PostureResult, value: float) -> PostureResult:
    """The result, INACCURATE and without the grid's bound where the objective is not `value`."""
    low, high = sorted((value, result.value))
    if high - low <= AGREEMENT * abs(high) + NOTHING * natural(problem):
        return result
    details = {name: of for name, of in result.details.items() if name != "grid_bound"}
    message = f"the objective is {result.value!r} where {value!r} was computed"
    return replace(result, status=OptimStatus.INACCURATE, details=details, message=message)


def _arrivals(grid: PostureGrid, progress: bool) -> tuple[np.ndarray, list[np.ndarray], int, float]:
    """Least cost of arriving at each node of the last waypoint, infinite where none arrives, or of
    the first waypoint where none does at all; the nodes before, at each waypoint up to that one;
    how many moves the rate and the constraints allow; the largest finite cost of all."""
    begin, criterion = grid.layers[0], grid.problem.posture.criterion
    cost = station_costs(criterion, begin.stations) if criterion.kind == "max" else 0.0
    costs, back, count = np.where(begin.admissible, cost, np.inf), [], 0
    size = _largest(costs)
    node = np.min_scalar_type(grid.shape[0] * grid.shape[1])
    with Bar(f"{grid.method}: paths", len(grid.layers) - 1, "step", progress) as bar:
        for step in range(len(grid.layers) - 1):
            if not np.any(np.isfinite(costs)):
                break
            costs, came, edges = _arrive(grid, step, costs)
            back.append(came.astype(node))
            count += edges
            size = max(size, _largest(costs))
            bar.advance()
    return costs, back, count, size


def _largest(costs: np.ndarray) -> float:
    return float(np.max(np.abs(costs), where=np.isfinite(costs), initial=0.0))


def _arrive(grid: PostureGrid, step: int, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Least costs of arriving at the next waypoint's nodes, the nodes before, and the number of
    moves; of equally good moves the shortest, and of those the first in `PostureGrid.moves`."""
    a, b = grid.layers[step], grid.layers[step + 1]
    given = grid.problem.posture.criterion, a.stations, b.stations, a.admissible, b.admissible
    if len(a.admissible) == len(b.admissible) == grid.shape[0] * grid.shape[1]:
        each = (np.arange(n, dtype=np.int32) for n in grid.shape)
        found = arrive_by_moves(*given, before, grid.moves(step), *each)
    else:
        found = arrive_from_all(*given, before, grid.near(step))
    return found[0], found[1], int(found[2])


station_costs = float64_program(criteria.station_cost)


def _joined(
    criterion: criteria.Criterion, before: Array, a: criteria.Station, b: criteria.Station
) -> Array:
    """Costs of arriving at stations b from stations a; infinite instead of NaN."""
    if criterion.kind == "max":
        total = jnp.maximum(before, criteria.station_cost(criterion, b))
    else:
        total = before + criteria.step_cost(criterion, a, b)
    return jnp.where(jnp.isnan(total), jnp.inf, total)


@float64_program
def arrive_by_moves(
    criterion: criteria.Criterion,
    a: criteria.Station,
    b: criteria.Station,
    good_a: Bool[Array, "N"],
    good_b: Bool[Array, "N"],
    before: Float[Array, "N"],
    moves: Int[Array, "moves 2"],
    rear: Int[Array, "R"],
    front: Int[Array, "F"],
) -> tuple[Array, Array, Array]:
    """`_arrive` between two layers of the whole grid, N = R F nodes: one move after the other."""
    R, F = len(rear), len(front)
    nodes = jnp.arange(R * F, dtype=jnp.int32)

    def take(found: tuple[Array, Array, Array], move: Array):
        best, came, count = found
        r, f = rear[:, None] - move[0], front - move[1]
        inside = (r >= 0) & (r < R) & (f >= 0) & (f < F)
        tail = jnp.clip(nodes - (move[0] * F + move[1]), 0, R * F - 1)
        good = inside.reshape(-1) & good_a[tail] & good_b
        total = _joined(criterion, before[tail], a.map(lambda of: of[tail]), b)
        better = good & (total < best)
        best, came = jnp.where(better, total, best), jnp.where(better, tail, came)
        return (best, came, count + jnp.sum(good)), None

    begin = jnp.full(R * F, jnp.inf), jnp.zeros(R * F, jnp.int32), jnp.zeros((), int)
    return jax.lax.scan(take, begin, moves)[0]


@float64_program
def arrive_from_all(
    criterion: criteria.Criterion,
    a: criteria.Station,
    b: criteria.Station,
    good_a: Bool[Array, "A"],
    good_b: Bool[Array, "B"],
    before: Float[Array, "A"],
    near: Bool[Array, "A B"],
) -> tuple[Array, Array, Array]:
    """`_arrive` between two layers of which one is a given pair of angles."""
    good = near & good_a[:, None] & good_b
    begin = a.map(lambda of: jnp.repeat(of[:, None], len(good_b), axis=1))
    total = _joined(criterion, before[:, None], begin, b.map(lambda of: of[None]))
    total = jnp.where(good, total, jnp.inf)
    return jnp.min(total, axis=0), jnp.argmin(total, axis=0).astype(jnp.int32), jnp.sum(good)
