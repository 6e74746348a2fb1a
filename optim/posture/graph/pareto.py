"""Pareto fronts of two criteria over the grid of leg angles, by dynamic programming.

Two sums over steps: weighted sums, whose optima are the front's points on its convex hull, found
where the hull may still have a corner (Aneja and Nair's scheme). A worst station with anything: a
level that it must not exceed only removes nodes from the grid, so the best of the other criterion
below each level is exact, and the front's points are found wherever they lie.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.optim.options import COUNT
from stickslip.optim.posture.criteria import Criterion, Weighted, criterion_by_name
from stickslip.optim.posture.graph.grid import PostureGrid, build_grid, station_costs
from stickslip.optim.posture.graph.search import best_paths
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

    criteria: their names, both minimised. values: [P, 2] in their units, by rising first; none
    where no path meets the constraints. x: decision vectors [P, 2K]. complete: whether these are
    all such points of the paths over the grid; for two sums, all corners of their convex hull, to
    END of the extents at its ends. paths: recursions solved.
    """

    criteria: tuple[str, str]
    values: Float[np.ndarray, "P 2"]
    x: Float[np.ndarray, "P n"]
    complete: bool
    paths: int


def pareto_front(
    problem: PostureProblem,
    first: str | Criterion,
    second: str | Criterion,
    *,
    points: int = 11,
    angles: Any = None,
    progress: bool = False,
) -> Front:
    """The front of two criteria, in place of the problem's own.

    points: how many are looked for, at most, 2 or more. angles: of each leg's grid, as for dp.
    Over the paths on the grid each point is proved to be on the front (of two sums on its convex
    hull: points inside are not found); off the grid nothing is.
    """
    points = require_integer("points", points, low=2, high=COUNT)
    one, two = _single("first", first), _single("second", second)
    grid = build_grid(replace(problem, criterion=one), angles, method="pareto", progress=progress)
    with Bar("pareto", None, "path", progress) as bar:
        search, sums = _Search(grid, (one, two), bar), one.additive and two.additive
        met, complete = (_supported if sums else _by_levels)(search, points)
    front = _unbeaten(met)
    return Front(
        criteria=(one.name, two.name),
        values=np.array([point.values for point in front]).reshape(-1, 2),
        x=np.array([point.x for point in front]).reshape(-1, problem.n),
        complete=complete,
        paths=search.paths,
    )


def _single(name: str, criterion: str | Criterion) -> Criterion:
    single = criterion_by_name(criterion)
    if isinstance(single, Weighted):
        raise ValueError(f"{name} = {single.name}; accepted: a single criterion")
    return single


class _Path(NamedTuple):
    """Values of both criteria, decision vector [2K] and nodes [K]."""

    values: tuple[float, float]
    x: np.ndarray
    nodes: np.ndarray


class _Search:
    """Best paths of one grid by several criteria and over parts of its nodes."""

    def __init__(self, grid: PostureGrid, criteria: tuple[Criterion, Criterion], bar: Bar):
        self.grid, self.criteria, self.bar, self.paths = grid, criteria, bar, 0

    def best(
        self, criterion: Criterion | Weighted, allowed: list[Bool[np.ndarray, "n"]] | None = None
    ) -> _Path | None:
        """The best path over the `allowed` nodes of each waypoint; None for none."""
        layers = self.grid.layers
        if allowed is not None:
            layers = [
                layer._replace(met=layer.met | {"level": of})
                for layer, of in zip(layers, allowed, strict=True)
            ]
        problem = replace(self.grid.problem, criterion=criterion)
        nodes = best_paths(replace(self.grid, problem=problem, layers=layers)).nodes
        self.paths += 1
        self.bar.advance()
        if nodes is None:
            return None
        x = self.grid.angles_at(nodes).reshape(-1)
        first, second = (replace(problem, criterion=one).objective(x) for one in self.criteria)
        return _Path((first, second), x, nodes)


def _supported(search: _Search, points: int) -> tuple[list[_Path], bool]:
    """Corners of the hull: between two known ones, the weights for which these are equally good
    show the corner farthest below their line, or that there is none."""

    first, second = search.criteria

    def solved(a: float, b: float) -> _Path | None:
        return search.best(Weighted(((first, a), (second, b))))

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


def _extent(pair: tuple[_Path, _Path], corners: list[_Path]) -> float:
    values = np.array([point.values for point in corners])
    size = np.maximum(np.ptp(values, axis=0), 1e-300)
    return float(np.prod(np.abs(np.subtract(pair[0].values, pair[1].values)) / size))


def _by_levels(search: _Search, points: int) -> tuple[list[_Path], bool]:
    """The best of one criterion for each of several levels of the other, a worst station."""
    which = int(search.criteria[1].additive)  # the main criterion's number
    main, limited = search.criteria[which], search.criteria[1 - which]
    costs = [station_costs(limited, layer.stations) for layer in search.grid.layers]

    def reached(path: _Path) -> float:
        return max(float(of[node]) for of, node in zip(costs, path.nodes, strict=True))

    def below(level: float, strictly: bool) -> _Path | None:
        return search.best(main, [of < level if strictly else of <= level for of in costs])

    def worse(path: _Path, other: _Path) -> bool:
        value = other.values[which]
        return path.values[which] > value + SAME * abs(value)

    least = search.best(limited)
    if least is None:
        return [], True
    low = reached(least)
    found: list[_Path] = []
    gaps, expected, high = False, None, None
    for share in np.linspace(0, 1, points):
        level = np.inf if high is None else high + share * (low - high)
        now = below(level if share < 1 else low, strictly=False)
        if now is None or (found and reached(now) >= reached(found[-1])):
            continue
        # Ties: as good by the main criterion, and better by the other.
        while (lower := below(reached(now), strictly=True)) and not worse(lower, now):
            now = lower
        gaps |= expected is not None and worse(now, expected)
        found.append(now)
        expected = lower
        high = reached(now) if high is None else high
        if lower is None:
            break
    return found, not gaps and expected is None


def _unbeaten(points: list[_Path]) -> list[_Path]:
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
