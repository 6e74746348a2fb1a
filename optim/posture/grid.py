"""Methods over every pair of leg angles at every waypoint: `grid`, the chapter's choice of each
waypoint by itself, and `dp`, the best path.

The costs of arriving, y, are potentials that bound all paths: y_head <= y_tail + cost for every
edge, so no path costs less than y at its end. That is the dual of the shortest path, without a
linear program.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.checks import require_memory
from stickslip.dynamics.status import Status
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import (
    PLACED,
    Criterion,
    Station,
    pointwise_cost,
    station_cost,
    step_cost,
)
from stickslip.optim.posture.evaluate import PostureResult, below, natural
from stickslip.optim.posture.waypoints import (
    CONVEX,
    LEAST,
    MOVE,
    ROUNDING,
    grid_angles,
    step_of,
    windows_of,
)
from stickslip.optim.problem import float64_program
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.optim.posture.problem import PostureProblem

CHUNK = evaluate.SIZES[-1]
"""Stations evaluated in one call, about: what bounds the memory."""
BETTER = 1e-9
"""Relative decrease below which a polished drive is no better than the grid's."""


class Layer(NamedTuple):
    """The stations [n] that may be chosen at a waypoint, and which constraints they meet."""

    stations: Station
    met: dict[str, Bool[np.ndarray, "n"]]

    @property
    def admissible(self) -> Bool[np.ndarray, "n"]:
        """Mask of postures that meet all constraints of a station."""
        return np.all(list(self.met.values()), axis=0)


@dataclass(frozen=True)
class PostureGrid:
    """The stations of K waypoints and N pairs of angles, as NumPy arrays.

    began: time of the start. rear, front: the angles of each leg [rad]; the pairs are all of one
    with all of the other, the front leg's running faster. layers: the choices at each waypoint;
    one, which need not lie on the grid, where the first or the last pair is given. method: that
    searches it.
    """

    problem: PostureProblem
    began: float
    rear: Float[np.ndarray, "R"]
    front: Float[np.ndarray, "F"]
    layers: list[Layer]
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

    @property
    def limits(self) -> Float[np.ndarray, "steps"]:
        """The longest move of a leg in each step [rad]."""
        rate = self.problem.leg_rate
        dx = np.diff(self.problem.x)
        return np.full(dx.shape, np.inf) if rate is None else float(rate) * dx

    @property
    def windows(self) -> Int[np.ndarray, "steps 2"]:
        """Grid steps that the rear and the front leg may move in each step."""
        most = [windows_of(angles, self.limits) for angles in (self.rear, self.front)]
        return np.stack(most, -1).astype(int)

    @property
    def stuck(self) -> str:
        """A sentence on steps in which the rate lets no leg reach its next angle; or nothing."""
        counts = np.array(self.shape)
        none = np.all((self.windows == 0) | (counts == 1), axis=1) & np.any(counts > 1)
        if not np.any(none):
            return ""
        gap = min(step_of(of) for of in (self.rear, self.front) if len(of) > 1)
        return (
            f"In {int(np.sum(none))} of {len(none)} steps no leg can move on the grid: its angles "
            f"are {gap:.4g} rad apart and leg_rate allows {np.min(self.limits[none]):.4g} rad; "
            "more angles or wider spacing of the waypoints would let them."
        )

    def angles_at(self, nodes: Sequence[int]) -> Float[np.ndarray, "K 2"]:
        each = zip(self.layers, nodes, strict=True)
        return np.stack([layer.stations.leg_angles[node] for layer, node in each])

    def edges(self, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Nodes before and after each admissible move of a step, in parts: one for each move in
        grid steps, the shortest first; all in one from or to a given pair."""
        a, b = self.layers[step : step + 2]
        good_a, good_b = a.admissible, b.admissible
        R, F = self.shape
        if len(good_a) != R * F or len(good_b) != R * F:
            turn = np.abs(b.stations.leg_angles - a.stations.leg_angles[:, None])
            near = np.max(turn, -1) <= self.limits[step] * (1 + ROUNDING)
            tail, head = np.nonzero(near & good_a[:, None] & good_b)
            yield tail, head
            return
        nodes = np.arange(R * F).reshape(R, F)
        for r, f in self._moves(*self.windows[step].tolist()):
            within = slice(max(0, -r), min(R, R - r)), slice(max(0, -f), min(F, F - f))
            tail = nodes[within].ravel()
            head = tail + r * F + f
            good = good_a[tail] & good_b[head]
            yield tail[good], head[good]

    def _moves(self, rear: int, front: int) -> list[tuple[int, int]]:
        """Moves of up to so many grid steps, the shortest first."""
        given = f"leg_rate = {self.problem.leg_rate} rad/m on this grid"
        require_memory(given, "moves", (2.0 * rear + 1) * (2.0 * front + 1), MOVE)
        both = [(r, f) for r in range(-rear, rear + 1) for f in range(-front, front + 1)]
        return sorted(both, key=lambda move: (abs(move[0]) + abs(move[1]), move))

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
        count = sum(len(layer.admissible) for layer in self.layers)
        return {"method": self.method, "began": self.began, "evaluations": count}

    def without_path(self, k: int) -> PostureResult:
        """The result where no path leads to waypoint k, though one does to k - 1.

        INFEASIBLE where the problem leaves one pair of angles at k, and that breaks a constraint.
        Else FAILED: there are angles off the grid, and a posture that ends in a numerical status
        (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is not known to be impossible.
        """
        layer, reason = self.layers[k], self.why_stuck(k)
        unplaced = ~layer.met["pose"]
        status, message = OptimStatus.FAILED, f"no {self.what}: {reason}"
        if np.any(unplaced):
            codes = layer.stations.status[unplaced]
            codes = np.where(np.isin(codes, PLACED), int(Status.NON_FINITE), codes)
            counts = Counter(Status(int(code)).name for code in codes)
            listed = ", ".join(f"{n} {name}" for name, n in counts.most_common())
            what = "hollow ground" if set(counts) == {"HOLLOW_GROUND"} else "no pose"
            message += f"; {what}: {len(codes)} of {unplaced.size} pairs of angles there ended "
            message += listed
        elif len(unplaced) == 1 and not layer.admissible[0]:
            status, message = OptimStatus.INFEASIBLE, f"infeasible: {reason}"
        return PostureResult.without_point(status=status, message=message, **self._common)


def build_grid(
    problem: PostureProblem, angles: Any, least: int, progress: bool, method: str = "dp"
) -> PostureGrid:
    """Evaluate all stations in float64.

    angles: how many for each leg, evenly spaced over its range, an integer or a pair; or None for
    `fitting_grid`, with `least` of each leg.
    """
    began = time.perf_counter()
    rear, front = grid_angles(problem, angles, least, CHUNK)
    pairs = np.stack(np.meshgrid(rear, front, indexing="ij"), -1).reshape(-1, 2)
    K = len(problem.x)
    rows = min(max(1, CHUNK // len(pairs)), K)
    layers: list[Layer] = []
    with Bar(method, K, "waypoint", progress) as bar:
        for begin in range(0, K, rows):
            at = np.arange(begin, min(begin + rows, K))
            layers += _evaluate(problem, at, pairs)
            bar.advance(len(at))
    for k, pair in ((0, problem.start_angles), (K - 1, problem.end_angles)):
        if pair is not None:
            layers[k] = _evaluate(problem, np.array([k]), pair[None])[0]
    return PostureGrid(problem, began, rear, front, layers, method)


def _evaluate(
    problem: PostureProblem, at: np.ndarray, pairs: Float[np.ndarray, "N 2"]
) -> list[Layer]:
    """Stations of those waypoints and which constraints they meet."""
    x, friction = problem.x[at], problem.posture.friction[at]
    stations = Station.of_rows(
        evaluate.rows_at(problem.posture, x[:, None], friction[:, None], pairs)
    )
    whole = Layer(stations, evaluate.met(problem.posture, stations))
    return [jax.tree.map(lambda of, i=i: of[i], whole) for i in range(len(at))]


AGREEMENT, NOTHING = 1e-8, 1e-12
"""Relative differences of the recursion's value and the objective above which it is no proof: to
the value, or, where that is near 0, to what the vehicle's weight would give."""
EDGES = 1 << 18
"""About the number of edges whose costs are computed in one call."""


def solve_grid(
    problem: PostureProblem, *, progress: bool = False, angles: Any = None, least: int = LEAST
) -> PostureResult:
    """Choose at each waypoint the admissible pair of leg angles whose own cost is least.

    The chapter's search. A worst-station criterion is judged by the station's cost. Sums over
    steps are not known of one station: wheel_energy and total_energy take |M| in their place,
    torque_variation |M - M'|, M' being the choice before (0 at the first waypoint). So such a
    choice has no bound.

    angles, least: of the grid, as in dp. leg_rate is not looked at, as in the chapter, and the
    result may break it (VIOLATED; its residuals say by how much). For single worst-station
    criteria grid_bound is the largest over the waypoints of the least cost there: no path over the
    grid is below it. evaluations: stations. details: grid, grid_bound (None for sums).
    """
    grid, criterion = build_grid(problem, angles, least, progress, "grid"), problem.criterion
    before = grid.layers[0].stations.map(lambda of: np.zeros_like(of[:1]))
    nodes: list[int] = []
    bound = -np.inf
    for k, layer in enumerate(grid.layers):
        if not np.any(layer.admissible):
            return grid.without_path(k)
        cost = np.where(layer.admissible, _pointwise(criterion, layer.stations, before), np.inf)
        bound = max(bound, float(np.min(cost)))
        nodes.append(int(np.argmin(cost)))
        before = layer.stations.map(lambda of: of[[nodes[-1]]])
    known = below(problem, bound) if criterion.kind == "max" else None
    message = "chosen point by point, leg_rate not looked at"
    return grid.result(nodes, message, grid_bound=known)


_pointwise = float64_program(pointwise_cost)


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
    value less its rounding and that of the stations (`below`): no path over the grid is better.
    INACCURATE where the objective is not within 1e-8 of the value, nor within 1e-12 of what the
    vehicle's weight would give. It bounds no drive off the grid, so that lower_bound is None;
    `solve(problem, "branch")` has one. FAILED where there is no path over the grid: see
    `without_path`. evaluations: stations. details: grid, grid_bound, edges (moves looked at).
    """
    K = len(problem.x)
    if polish:
        require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)
    grid = build_grid(problem, angles, least, progress)
    costs, back, edges = _arrivals(grid, progress)
    if not np.any(np.isfinite(costs[-1])):
        return grid.without_path(len(costs) - 1)
    nodes = [int(np.argmin(costs[-1]))]
    for came in back[::-1]:
        nodes.append(int(came[nodes[-1]]))
    message = grid.stuck or f"proved: the best of all {grid.what}, not of all drives"
    found = grid.result(nodes[::-1], message, grid_bound=_bound(problem, costs), edges=edges)
    found = _agreed(problem, found, float(np.min(costs[-1])))
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


def _bound(problem: PostureProblem, costs: list[np.ndarray]) -> float:
    """A number that no path over the grid is below, whatever its sums and stations round."""
    every = np.concatenate(costs)
    size = float(np.max(np.abs(every[np.isfinite(every)]), initial=0.0))
    rounding = 4 * np.finfo(float).eps * size * (len(costs) + 1)
    return below(problem, float(np.min(costs[-1])) - rounding)


def _arrivals(
    grid: PostureGrid, progress: bool = False
) -> tuple[list[np.ndarray], list[np.ndarray], int]:
    """Least cost of arriving at each node of each waypoint, infinite where none arrives, up to the
    first waypoint where none does at all; the nodes before; how many moves the rate and the
    constraints allow."""
    costs, back, count = [_first_costs(grid)], [], 0
    with Bar("dp: paths", len(grid.layers) - 1, "step", progress) as bar:
        for step in range(len(grid.layers) - 1):
            if not np.any(np.isfinite(costs[-1])):
                break
            cost, came, edges = _arrive(grid, step, costs[-1])
            costs.append(cost)
            back.append(came)
            count += edges
            bar.advance()
    return costs, back, count


def _first_costs(grid: PostureGrid) -> np.ndarray:
    """The cost of beginning at each node of the first waypoint."""
    begin, criterion = grid.layers[0], grid.problem.posture.criterion
    cost = station_costs(criterion, begin.stations) if criterion.kind == "max" else 0.0
    return np.where(begin.admissible, cost, np.inf)


def _arrive(grid: PostureGrid, step: int, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Least costs of arriving at the next waypoint's nodes, the nodes before, and the number of
    moves; of equally good moves the first one in the order of `PostureGrid.edges`."""
    join = np.maximum if grid.problem.criterion.kind == "max" else np.add
    a, b = (layer.stations for layer in grid.layers[step : step + 2])
    best, came, count = np.full(b.x.shape, np.inf), np.zeros(b.x.shape, dtype=int), 0
    for tail, head in _batches(grid.edges(step)):
        size = 1 << max(len(tail) - 1, 0).bit_length()  # few programs, whatever is admissible
        ends = (np.resize(of, size).astype(np.int32) for of in (tail, head))
        cost = edge_costs(grid.problem.posture.criterion, a, b, *ends)[: len(tail)]
        total = join(before[tail], cost)
        total = np.where(np.isnan(total), np.inf, total)
        last = best.copy()
        np.minimum.at(best, head, total)
        better = np.flatnonzero((total == best[head]) & (total < last[head]))[::-1]
        came[head[better]] = tail[better]
        count += len(tail)
    return best, came, count


station_costs = float64_program(station_cost)


@float64_program
def edge_costs(
    criterion: Criterion,
    a: Station,
    b: Station,
    tail: Int[Array, "E"],
    head: Int[Array, "E"],
) -> Float[Array, "E"]:
    """Costs of moves from nodes `tail` of a to nodes `head` of b: of the step, or for worst
    stations of the station where it ends."""
    if criterion.kind == "max":
        return station_cost(criterion, b)[head]
    return step_cost(criterion, a.map(lambda of: of[tail]), b.map(lambda of: of[head]))


def _batches(parts: Iterator[tuple[np.ndarray, np.ndarray]]) -> Iterator[np.ndarray]:
    """The same edges [2, n], about EDGES at a time; none that are empty."""
    waiting: list[np.ndarray] = []
    count = 0
    for part in parts:
        waiting.append(np.stack(part))
        count += len(part[0])
        if count >= EDGES:
            yield np.concatenate(waiting, axis=1)
            waiting, count = [], 0
    if count:
        yield np.concatenate(waiting, axis=1)
