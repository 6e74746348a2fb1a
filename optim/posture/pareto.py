"""Pareto fronts of two criteria over the grid of leg angles, by dynamic programming.

Two sums over steps: weighted sums, whose optima are the front's points on its convex hull, found
where the hull may still have a corner (Aneja and Nair's scheme). A worst station with anything: a
level that it must not exceed only removes nodes from the grid, so the best of the other criterion
below each level is exact, and the front's points are found wherever they lie.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer
from stickslip.optim.options import COUNT
from stickslip.optim.posture.criteria import Criterion, Weighted, criterion_by_name, station_cost
from stickslip.optim.posture.dp import angles_at, best_paths
from stickslip.optim.posture.impossible import judged
from stickslip.optim.posture.posture_grid import PostureGrid, build_grid
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.posture.problem import PostureProblem

SAME = 1e-10
"""Values that differ by less than this, relative to their size, count as the same."""
END = 1e-6
"""The weight that the ends of a front of sums give the other criterion, in parts of the extents."""


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
    one, two = (_single(name, given) for name, given in (("first", first), ("second", second)))
    grid = build_grid(replace(problem, criterion=one), angles, method="pareto", progress=progress)
    with Bar("pareto", None, "path", progress) as bar:
        search = _Search(grid, bar)
        if one.additive and two.additive:
            found, complete = _supported(search, one, two, points)
            proved = (
                "each minimises a weighted sum over the grid, so is on the front's convex hull, "
                f"the ends to {END:g} of the extents; points of the front inside the hull are not "
                "found"
            )
        else:
            found, complete = _by_levels(search, one, two, points)
            proved = (
                "each is the best of one criterion over the grid for what it has of the other, and "
                "no path is as good in one and better in the other"
            )
    values = np.array([point.values for point in found]).reshape(-1, 2)
    keep = [i for i in np.argsort(values[:, 0], kind="stable") if not _beaten(values, i)]
    x = np.array([found[i].x for i in keep]).reshape(-1, problem.n)
    return Front(
        criteria=(one.name, two.name),
        values=values[keep],
        x=x,
        complete=complete,
        proved=proved if found else judged(grid, "no path on the grid meets the constraints")[1],
        proved_for=grid.what,
        paths=search.paths,
        seconds=time.perf_counter() - began,
    )


def _single(name: str, given: str | Criterion) -> Criterion:
    found = criterion_by_name(given)
    if isinstance(found, Weighted):
        raise ValueError(f"{name} = {found.name}; accepted: a single criterion")
    return found


@dataclass(frozen=True)
class _Point:
    values: tuple[float, float]
    x: np.ndarray


class _Search:
    """Best paths of one grid by several criteria and over parts of its nodes."""

    def __init__(self, grid: PostureGrid, bar: Bar):
        self.grid, self.bar, self.paths = grid, bar, 0

    def best(
        self, criterion: Criterion | Weighted, allowed: list[np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """The best path's nodes and decision vector over the `allowed` nodes; None for none."""
        grid = self.grid if allowed is None else _restricted(self.grid, allowed)
        grid = replace(grid, problem=replace(grid.problem, criterion=criterion))
        nodes = best_paths(grid).nodes
        self.paths += 1
        self.bar.advance()
        return None if nodes is None else (nodes, angles_at(grid, nodes).reshape(-1))

    def value(self, criterion: Criterion, x: np.ndarray) -> float:
        """The problem's own value by that criterion."""
        return replace(self.grid.problem, criterion=criterion).objective(x)

    def node_costs(self, criterion: Criterion) -> list[np.ndarray]:
        """The cost of each node of each waypoint, by a criterion of stations."""
        with jax.enable_x64(True):
            layers = [self.grid.layer(k)[0] for k in range(len(self.grid.problem.x))]
            return [np.asarray(station_cost(criterion, layer)) for layer in layers]


def _restricted(grid: PostureGrid, allowed: list[Bool[np.ndarray, "N"]]) -> PostureGrid:
    """The grid with only the allowed nodes of each waypoint."""
    K, N = grid.stations.torque.shape
    inner = np.stack([of if len(of) == N else np.ones(N, bool) for of in allowed])
    ends = [
        None if end is None else (end[0], end[1] | {"level": allowed[k]})
        for k, end in ((0, grid.start), (K - 1, grid.end))
    ]
    return replace(grid, ok=grid.ok | {"level": inner}, start=ends[0], end=ends[1])


def _supported(
    search: _Search, one: Criterion, two: Criterion, points: int
) -> tuple[list[_Point], bool]:
    """Corners of the hull: between two known ones, the weights for which these are equally good
    show the corner farthest below their line, or that there is none."""

    def solved(a: float, b: float) -> _Point | None:
        found = search.best(Weighted(((one, a), (two, b))))
        if found is None:
            return None
        x = found[1]
        return _Point((search.value(one, x), search.value(two, x)), x)

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
    found, open_pairs = [left, right], [(left, right)]
    while open_pairs and len(found) < points:
        # The widest gap first, in parts of the front's extent.
        open_pairs.sort(key=lambda pair: _extent(pair, found))
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
        found.append(new)
        open_pairs += [(a, new), (new, b)]
    return found, not open_pairs


def _extent(pair: tuple[_Point, _Point], found: list[_Point]) -> float:
    values = np.array([point.values for point in found])
    size = np.maximum(np.ptp(values, axis=0), 1e-300)
    return float(np.prod(np.abs(np.subtract(pair[0].values, pair[1].values)) / size))


def _by_levels(
    search: _Search, one: Criterion, two: Criterion, points: int
) -> tuple[list[_Point], bool]:
    """The best of one criterion for each of several levels of the other, a worst station."""
    swapped = two.additive
    main, limited = (two, one) if swapped else (one, two)
    costs = search.node_costs(limited)

    def below(level: float, strictly: bool) -> _Level | None:
        allowed = [of < level if strictly else of <= level for of in costs]
        found = search.best(main, allowed)
        if found is None:
            return None
        reached = max(float(of[node]) for of, node in zip(costs, found[0], strict=True))
        return _Level(search.value(main, found[1]), reached, found[1])

    least = search.best(limited)
    if least is None:
        return [], True
    low = max(float(of[node]) for of, node in zip(costs, least[0], strict=True))
    found: list[_Level] = []
    gaps, expected, high = False, None, None
    for share in np.linspace(0, 1, points):
        level = np.inf if high is None else high + share * (low - high)
        now = below(level if share < 1 else low, strictly=False)
        if now is None or (found and now.reached >= found[-1].reached):
            continue
        # Ties: as good by the main criterion, and better by the other.
        while (lower := below(now.reached, strictly=True)) and not lower.worse_than(now):
            now = lower
        gaps |= expected is not None and now.worse_than(expected)
        found.append(now)
        expected = lower
        high = now.reached if high is None else high
        if lower is None:
            break
    pairs = ((at.value, at.reached) for at in found)
    values = [(b, a) if swapped else (a, b) for a, b in pairs]
    ends = [_Point(pair, at.x) for pair, at in zip(values, found, strict=True)]
    return ends, not gaps and expected is None


@dataclass(frozen=True)
class _Level:
    """The best value of the main criterion below a level of the other, and what it reaches."""

    value: float
    reached: float
    x: np.ndarray

    def worse_than(self, other: _Level) -> bool:
        """By the main criterion."""
        return self.value > other.value + SAME * abs(other.value)


def _beaten(values: np.ndarray, i: int) -> bool:
    """Whether another point is as good in both and better in one, or the same and earlier."""
    slack = SAME * np.abs(values[i])
    as_good = np.all(values <= values[i] + slack, axis=1)
    better = np.any(values < values[i] - slack, axis=1)
    same = np.all(np.abs(values - values[i]) <= slack, axis=1) & (np.arange(len(values)) < i)
    return bool(np.any(as_good & (better | same)))
