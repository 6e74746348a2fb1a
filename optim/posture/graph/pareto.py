"""Pareto fronts of two criteria over the grid of leg angles, by dynamic programming.

Two sums over steps: weighted sums, whose optima are the front's points on its convex hull, found
where the hull may still have a corner (Aneja and Nair's scheme). A worst station with anything: a
level that it must not exceed only removes nodes from the grid, so the best of the other criterion
below each level is exact, and the front's points are found wherever they lie.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer
from stickslip.optim.options import COUNT
from stickslip.optim.posture.criteria import Criterion, Weighted, criterion_by_name, station_cost
from stickslip.optim.posture.graph.grid import PostureGrid, build_grid
from stickslip.optim.posture.graph.search import angles_at, best_paths
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.posture.problem import PostureProblem

SAME = 1e-10
"""Values that differ by less than this, relative to their size, count as the same."""
END = 1e-6
"""The weight that the ends of a front of sums give the other criterion, in parts of the extents."""
PROVED_SUMS = (
    "each minimises a weighted sum over the grid, so is on the front's convex hull, the ends to "
    f"{END:g} of the extents; points of the front inside the hull are not found"
)
PROVED_LEVELS = (
    "each is the best of one criterion over the grid for what it has of the other, and no path is "
    "as good in one and better in the other"
)
"""Proved property of points from weighted sums, and from levels."""


@dataclass(frozen=True)
class Front:
    """Points none of which is better than another in both criteria.

    criteria: their names, both minimised. values: [P, 2] in their units, by rising first. x:
    decision vectors [P, 2K]. complete: whether these are all such points of `proved_for` (of those
    on the convex hull: all its corners). proved: what is known of them. paths: recursions solved.
    """

    criteria: tuple[str, str]
    values: Float[np.ndarray, "P 2"]
    x: Float[np.ndarray, "P n"]
    complete: bool
    proved: str
    proved_for: str
    paths: int
    seconds: float


def pareto_front(
    problem: PostureProblem,
    first: str | Criterion,
    second: str | Criterion,
    *,
    points: int = 11,
    angles: Any = None,
    method: str = "dp",
    progress: bool = False,
) -> Front:
    """The front of two criteria, in place of the problem's own.

    points: how many are looked for, at most, 2 or more. angles: of each leg's grid, as for dp.
    method: "dp" alone. Over the paths on the grid each point is proved to be on the front; off the
    grid nothing is. An empty front: no path meets the constraints.
    """
    began = time.perf_counter()
    require_choice("method", method, ("dp",))
    points = require_integer("points", points, low=2, high=COUNT)
    one, two = _single("first", first), _single("second", second)
    grid = build_grid(replace(problem, criterion=one), angles, method="pareto", progress=progress)
    with Bar("pareto", None, "path", progress) as bar:
        search, sums = _Search(grid, bar), one.additive and two.additive
        met, complete = (_supported if sums else _by_levels)(search, one, two, points)
    proved = PROVED_SUMS if sums else PROVED_LEVELS
    if not met:
        proved = "no path over the grid meets the constraints"
    front = _unbeaten(met)
    return Front(
        criteria=(one.name, two.name),
        values=np.array([point.values for point in front]).reshape(-1, 2),
        x=np.array([point.x for point in front]).reshape(-1, problem.n),
        complete=complete,
        proved=proved,
        proved_for=grid.what,
        paths=search.paths,
        seconds=time.perf_counter() - began,
    )


def _single(name: str, criterion: str | Criterion) -> Criterion:
    single = criterion_by_name(criterion)
    if isinstance(single, Weighted):
        raise ValueError(f"{name} = {single.name}; accepted: a single criterion")
    return single


@dataclass(frozen=True)
class _Point:
    values: tuple[float, float]
    x: np.ndarray


class _Path(NamedTuple):
    """Nodes [K] and decision vector [2K]."""

    nodes: np.ndarray
    x: np.ndarray


class _Search:
    """Best paths of one grid by several criteria and over parts of its nodes."""

    def __init__(self, grid: PostureGrid, bar: Bar):
        self.grid, self.bar, self.paths = grid, bar, 0

    def best(
        self, criterion: Criterion | Weighted, allowed: list[np.ndarray] | None = None
    ) -> _Path | None:
        """The best path over the `allowed` nodes; None for none."""
        grid = self.grid if allowed is None else _restricted(self.grid, allowed)
        grid = replace(grid, problem=replace(grid.problem, criterion=criterion))
        nodes = best_paths(grid).nodes
        self.paths += 1
        self.bar.advance()
        return None if nodes is None else _Path(nodes, angles_at(grid, nodes).reshape(-1))

    def value(self, criterion: Criterion, x: np.ndarray) -> float:
        """The problem's own value by that criterion."""
        return replace(self.grid.problem, criterion=criterion).objective(x)

    def node_costs(self, criterion: Criterion) -> list[np.ndarray]:
        """The cost of each node of each waypoint, by a criterion of stations."""
        with jax.enable_x64(True):
            layers = [self.grid.layer(k).stations for k in range(len(self.grid.problem.x))]
            return [np.asarray(station_cost(criterion, layer)) for layer in layers]


def _restricted(grid: PostureGrid, allowed: list[Bool[np.ndarray, "N"]]) -> PostureGrid:
    """The grid with only the allowed nodes of each waypoint."""
    K, N = grid.stations.torque.shape
    inner = np.stack([of if len(of) == N else np.ones(N, bool) for of in allowed])
    ends = [
        None if end is None else end._replace(met=end.met | {"level": allowed[k]})
        for k, end in ((0, grid.start), (K - 1, grid.end))
    ]
    return replace(grid, ok=grid.ok | {"level": inner}, start=ends[0], end=ends[1])


def _supported(
    search: _Search, first: Criterion, second: Criterion, points: int
) -> tuple[list[_Point], bool]:
    """Corners of the hull: between two known ones, the weights for which these are equally good
    show the corner farthest below their line, or that there is none."""

    def solved(a: float, b: float) -> _Point | None:
        path = search.best(Weighted(((first, a), (second, b))))
        if path is None:
            return None
        values = search.value(first, path.x), search.value(second, path.x)
        return _Point(values, path.x)

    ends = solved(1.0, 0.0), solved(0.0, 1.0)
    if ends[0] is None or ends[1] is None:
        return [], True
    (f1, g1), (f2, g2) = (end.values for end in ends if end)
    if f2 - f1 > SAME * abs(f1) and g1 - g2 > SAME * abs(g2):
        # Some weight on the other criterion, too: of equally good paths, one that none beats.
        slope = (f2 - f1) / (g1 - g2)
        ends = solved(1.0, END * slope), solved(END, slope)
    left, right = ends
    if left is None or right is None:
        return [], True
    corners, open_pairs = [left, right], [(left, right)]
    while open_pairs and len(corners) < points:
        # The widest gap first, in parts of the front's extent.
        open_pairs.sort(key=lambda pair: _extent(pair, corners))
        a, b = open_pairs.pop()
        (f1, g1), (f2, g2) = a.values, b.values
        if g1 - g2 <= SAME * abs(g1) or f2 - f1 <= SAME * abs(f2):
            continue
        new = solved(g1 - g2, f2 - f1)
        line = (g1 - g2) * f1 + (f2 - f1) * g1
        if new is None or line - ((g1 - g2) * new.values[0] + (f2 - f1) * new.values[1]) <= (
            1e-9 * abs(line)
        ):
            continue
        corners.append(new)
        open_pairs += [(a, new), (new, b)]
    return corners, not open_pairs


def _extent(pair: tuple[_Point, _Point], corners: list[_Point]) -> float:
    values = np.array([point.values for point in corners])
    size = np.maximum(np.ptp(values, axis=0), 1e-300)
    return float(np.prod(np.abs(np.subtract(pair[0].values, pair[1].values)) / size))


def _by_levels(
    search: _Search, first: Criterion, second: Criterion, points: int
) -> tuple[list[_Point], bool]:
    """The best of one criterion for each of several levels of the other, a worst station."""
    swapped = second.additive
    main, limited = (second, first) if swapped else (first, second)
    costs = search.node_costs(limited)

    def worst(path: _Path) -> float:
        return max(float(of[node]) for of, node in zip(costs, path.nodes, strict=True))

    def below(level: float, strictly: bool) -> _Level | None:
        allowed = [of < level if strictly else of <= level for of in costs]
        path = search.best(main, allowed)
        return None if path is None else _Level(search.value(main, path.x), worst(path), path.x)

    least = search.best(limited)
    if least is None:
        return [], True
    low = worst(least)
    levels: list[_Level] = []
    gaps, expected, high = False, None, None
    for share in np.linspace(0, 1, points):
        level = np.inf if high is None else high + share * (low - high)
        now = below(level if share < 1 else low, strictly=False)
        if now is None or (levels and now.reached >= levels[-1].reached):
            continue
        # Ties: as good by the main criterion, and better by the other.
        while (lower := below(now.reached, strictly=True)) and not lower.worse_than(now):
            now = lower
        gaps |= expected is not None and now.worse_than(expected)
        levels.append(now)
        expected = lower
        high = now.reached if high is None else high
        if lower is None:
            break
    front = [
        _Point((at.reached, at.value) if swapped else (at.value, at.reached), at.x) for at in levels
    ]
    return front, not gaps and expected is None


@dataclass(frozen=True)
class _Level:
    """The best value of the main criterion below a level of the other, and what it reaches."""

    value: float
    reached: float
    x: np.ndarray

    def worse_than(self, other: _Level) -> bool:
        """Compare by the main criterion."""
        return self.value > other.value + SAME * abs(other.value)


def _unbeaten(points: list[_Point]) -> list[_Point]:
    """Those that no other point beats, by rising first value."""
    values = np.array([point.values for point in points]).reshape(-1, 2)
    order = np.argsort(values[:, 0], kind="stable")
    return [points[i] for i in order if not _beaten(values, i)]


def _beaten(values: np.ndarray, i: int) -> bool:
    """True if another point is as good in both and better in one, or the same and earlier."""
    slack = SAME * np.abs(values[i])
    as_good = np.all(values <= values[i] + slack, axis=1)
    better = np.any(values < values[i] - slack, axis=1)
    same = np.all(np.abs(values - values[i]) <= slack, axis=1) & (np.arange(len(values)) < i)
    return bool(np.any(as_good & (better | same)))
