"""Every pair of leg angles at every waypoint: the grid that `grid`, `dp` and `lp` search."""

from __future__ import annotations

import inspect
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.checks import require_integer, require_memory, require_number, shown
from stickslip.dynamics.status import Status
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.station import PLACED, Station
from stickslip.optim.posture.waypoints import CONVEX, require_grid, require_moves
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.numeric import Number
    from stickslip.optim.posture.problem import PostureProblem


LEAST = 31
"""Default least number of angles of each leg in a grid."""
FINEST = 96
"""Angles of each leg that a fitting grid has at most."""
USED = 0.95
"""Share of the legs' rate that moves over the grid should be able to use."""
ROUNDING = 1e-9
"""Part of a grid step, or of an allowed move, by which a move may seem too long."""
CHUNK = evaluate.SIZES[-1]
"""Stations evaluated in one call, about: what bounds the memory."""


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

    rear, front: the angles of each leg [rad]; the pairs are all of one with all of the other, the
    front leg's running faster. stations: [K, N]. start, end: the layer of one station at the first
    and at the last waypoint, where its pair is given: the only choice there, which need not lie on
    the grid.
    """

    problem: PostureProblem
    rear: Float[np.ndarray, "R"]
    front: Float[np.ndarray, "F"]
    stations: Station
    ok: dict[str, Bool[np.ndarray, "K N"]]
    """Mask of stations that meet each group of constraints."""
    start: Layer | None
    end: Layer | None

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of angles of the rear and the front leg."""
        return len(self.rear), len(self.front)

    @property
    def what(self) -> str:
        """The set of drives that is searched, in words."""
        text = f"paths over the {self.shape[0]} x {self.shape[1]} grid of leg angles"
        ends = [w for w, at in (("start", self.start), ("end", self.end)) if at is not None]
        return text + (f" with the given {' and '.join(ends)}" if ends else "")

    @property
    def evaluations(self) -> int:
        """Stations evaluated."""
        return self.stations.torque.size + (self.start is not None) + (self.end is not None)

    @property
    def limits(self) -> Float[np.ndarray, "steps"]:
        """The longest move of a leg in each step [rad]."""
        rate = self.problem.leg_rate
        dx = np.diff(self.problem.x)
        return np.full(dx.shape, np.inf) if rate is None else float(rate) * dx

    def windows(self) -> np.ndarray:
        """Grid steps that the rear and the front leg may move in each step [K-1, 2]."""
        most = [windows_of(angles, self.limits) for angles in (self.rear, self.front)]
        return np.stack(most, -1).astype(np.int32)

    @property
    def details(self) -> dict[str, Any]:
        """Details of results: number of angles of each leg, and share of its rate
        it can use on them."""
        used = tuple(rate_used(angles, self.limits) for angles in (self.rear, self.front))
        return {"grid": self.shape, "rate_used": used}

    @property
    def stuck(self) -> str:
        """A sentence on steps in which the rate lets no leg reach its next angle; or nothing."""
        counts = np.array(self.shape)
        none = np.all((self.windows() == 0) | (counts == 1), axis=1) & np.any(counts > 1)
        if not np.any(none):
            return ""
        gap = min(step_of(of) for of in (self.rear, self.front) if len(of) > 1)
        return (
            f"In {int(np.sum(none))} of {len(none)} steps no leg can move on the grid: its angles "
            f"are {gap:.4g} rad apart and leg_rate allows {np.min(self.limits[none]):.4g} rad; "
            "more angles or wider spacing of the waypoints would let them."
        )

    def admissible(self, k: int) -> Bool[np.ndarray, "n"]:
        """Mask of the nodes of waypoint k that meet all constraints of a station."""
        return self.layer(k).admissible

    def layer(self, k: int) -> Layer:
        """Admissible nodes at waypoint k."""
        last = len(self.problem.x) - 1
        if k == 0 and self.start is not None:
            return self.start
        if k == last and self.end is not None:
            return self.end
        met = {name: of[k] for name, of in self.ok.items()}
        return Layer(self.stations.map(lambda of: of[k]), met)

    @property
    def free(self) -> tuple[int, int]:
        """The first waypoint whose choice is the grid's, and one past the last."""
        return int(self.start is not None), len(self.problem.x) - int(self.end is not None)

    def within(self, step: int, a: Number, b: Number) -> np.ndarray:
        """True if the rate allows the move from angles a to b [..., 2] in that step."""
        move = np.max(np.abs(np.asarray(b) - np.asarray(a)), -1)
        return move <= self.limits[step] * (1 + ROUNDING)

    def why_none(self, k: int) -> str:
        """Text of the constraints that leave no pair at waypoint k; empty where some are left."""
        layer = self.layer(k)
        met, count = layer.met, len(layer.admissible)
        if np.any(layer.admissible):
            return ""
        given = ", the given one," if count == 1 else ""
        where = f"at waypoint {k} (x = {self.problem.x[k]:.6g} m)"
        alone = [name for name, of in met.items() if not np.any(of)]
        if alone:
            return f"{where} no pair of angles{given} meets {' nor '.join(alone)}"
        broken = {name: int(np.sum(~of)) for name, of in met.items() if not np.all(of)}
        each = ", ".join(f"{name} rules out {n} of {count}" for name, n in broken.items())
        return f"{where} no pair of angles meets all constraints: {each}"

    def why_stuck(self, k: int, reached: np.ndarray) -> str:
        """Text of why no node of waypoint k is reached from the `reached` ones of k - 1."""
        none = self.why_none(k)
        if none or k == 0:
            return none
        if self.problem.leg_rate is None:
            return f"the criterion is not finite at waypoint {k} on any of them"
        left = int(np.sum(self.admissible(k)))
        reason = (
            f"leg_rate = {self.problem.leg_rate} rad/m lets none of the "
            f"{int(np.sum(reached))} pairs that are reached at waypoint {k - 1} move to any of the "
            f"{left} admissible ones at waypoint {k} (x = {self.problem.x[k]:.6g} m) on this grid"
        )
        return f"{reason}. {self.stuck}" if self.stuck else reason


def build_grid(
    problem: PostureProblem, angles: Any, *, method: str, progress: bool, least: int = LEAST
) -> PostureGrid:
    """Evaluate all stations in float64.

    angles: how many for each leg, evenly spaced over its range, an integer or a pair; or evenly
    spaced angles of each leg themselves [rad], a pair of arrays; or None for `fitting_grid`, with
    `least` of each leg.
    """
    legs = fitting_grid(problem, least) if angles is None else _pair(angles)
    counts = [of if isinstance(of, int) else len(of) for of in legs]
    require_grid(problem, counts[0], counts[1], CHUNK)
    rear, front = (_angles_of(problem, of) for of in legs)
    pairs = np.stack(np.meshgrid(rear, front, indexing="ij"), -1).reshape(-1, 2)
    K = len(problem.x)
    rows = min(max(1, CHUNK // len(pairs)), K)
    friction = problem.posture.friction
    chunks = []
    with Bar(method, K, "waypoint", progress) as bar:
        for begin in range(0, K, rows):
            at = slice(begin, begin + rows)
            chunks.append(_evaluate(problem, problem.x[at], friction[at], pairs))
            bar.advance(min(rows, K - begin))
    whole = jax.tree.map(lambda *of: np.concatenate(of), *chunks)
    start, end = (
        None if pair is None else _given_layer(problem, k, pair)
        for k, pair in ((0, problem.start_angles), (-1, problem.end_angles))
    )
    return PostureGrid(problem, rear, front, whole.stations, whole.met, start, end)


def _given_layer(problem: PostureProblem, k: int, pair: np.ndarray) -> Layer:
    """The one choice at waypoint k."""
    row = _evaluate(problem, problem.x[[k]], problem.posture.friction[[k]], pair[None])
    return jax.tree.map(lambda of: of[0], row)


def _evaluate(
    problem: PostureProblem,
    x: Float[Array | np.ndarray, "rows"],
    friction: Float[Array | np.ndarray, "rows"],
    pairs: Float[np.ndarray, "rows N 2"],
) -> Layer:
    """Stations [rows, N] and which constraints they meet."""
    rows = evaluate.rows_at(problem.posture, x[:, None], friction[:, None], pairs)
    return Layer(Station.unpacked(rows), evaluate.met(problem.posture, rows))


def _pair(angles: Any) -> tuple[Any, Any]:
    """A count or the angles of each leg."""
    accepted = "an integer >= 2, or for each leg one or its evenly spaced angles [rad]"
    listed = angles.tolist() if isinstance(angles, np.ndarray) else angles
    both = listed if isinstance(listed, tuple | list) else (listed, listed)
    if len(both) != 2:
        raise ValueError(f"angles = {shown(angles)}; accepted: {accepted}")
    rear, front = (
        _evenly_spaced(of, accepted)
        if isinstance(of, tuple | list | np.ndarray) and len(np.shape(of)) == 1
        else require_integer("angles", of, low=2, accepted=accepted)
        for of in both
    )
    return rear, front


def _evenly_spaced(angles: Any, accepted: str) -> np.ndarray:
    require_number("angles", angles, accepted=accepted, dtype=np.float64)
    array = np.array(angles, dtype=float)
    steps = np.diff(array)
    if np.any(steps <= 0) or not np.allclose(steps, step_of(array), rtol=1e-6, atol=0):
        raise ValueError(f"angles = {shown(angles)} are not evenly spaced; accepted: {accepted}")
    return array


def _angles_of(problem: PostureProblem, leg: Any) -> np.ndarray:
    """A leg's angles [rad] from how many they are, or as given, which must lie in its range."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    if isinstance(leg, int):
        return np.linspace(low, high, leg) if low < high else np.array([low])
    if leg[0] < low - ROUNDING or leg[-1] > high + ROUNDING:
        raise ValueError(
            f"angles from {leg[0]:.6g} to {leg[-1]:.6g} rad; accepted: within the legs' range, "
            f"{low:.6g} to {high:.6g} rad"
        )
    return np.clip(leg, low, high)


def offsets(grid: PostureGrid) -> Iterator[tuple[int, int]]:
    """All moves in grid steps that the widest window allows, shortest first."""
    wide = grid.windows().max(axis=0)
    require_moves(grid.problem, wide)
    moves = [
        (r, f)
        for r in range(-int(wide[0]), int(wide[0]) + 1)
        for f in range(-int(wide[1]), int(wide[1]) + 1)
    ]
    yield from sorted(moves, key=lambda move: (abs(move[0]) + abs(move[1]), move))


def fitting_grid(
    problem: PostureProblem, least: int = LEAST
) -> tuple[Float[np.ndarray, "R"], Float[np.ndarray, "F"]]:
    """Evenly spaced angles of the rear and of the front leg [rad], at least so many each.

    On a grid a leg moves by whole steps alone: with steps of 70 % of what the rate allows between
    waypoints, 30 % of the rate lie idle, and all of it with steps of 101 %. So the step is a whole
    part of leg_rate times the shortest spacing, and the angles run through the given start and
    end (through the start alone where no such step leads from one to the other; through the middle
    of the range where neither is given). Less than a step is left out at the ends of the range.
    Where FINEST angles do not suffice, only those within reach of the given ends are taken; and
    where even these are too many, or the rate has no limit, `least` over the whole range.
    """
    least = require_integer("least", least, low=2)
    ends = [of for of in (problem.start_angles, problem.end_angles) if of is not None]
    rear, front = (_of_leg(problem, [float(at[leg]) for at in ends], least) for leg in (0, 1))
    return rear, front


def _of_leg(problem: PostureProblem, ends: list[float], least: int) -> np.ndarray:
    """One leg's angles; ends: its angles where the first or the last pair is given."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    if low == high:
        return np.array([low])
    whole = np.linspace(low, high, least)
    if problem.leg_rate is None:
        return whole
    spacing = np.diff(problem.x)
    limit = float(problem.leg_rate) * float(np.min(spacing))
    reach = float(problem.leg_rate) * float(np.sum(spacing))
    near = max([low, *(at - reach for at in ends)]), min([high, *(at + reach for at in ends)])
    most = max(FINEST, least)
    for below, above in ((low, high), near):
        width = above - below
        if not 0 < width <= limit * (most - 1) * (1 + ROUNDING):
            continue
        parts = max(int(np.ceil(limit * least / width - ROUNDING)), 1)
        finest = max(int(limit * (most - 1) / width + ROUNDING), parts)
        step = _step(limit, range(parts, finest + 1), ends)
        return _through(ends[0] if ends else (below + above) / 2, step, below, above)
    return whole


def _step(limit: float, parts: range, ends: list[float]) -> float:
    """The longest step that uses the rate well and leads from the one given angle to the other;
    or the longest that uses the rate."""
    between = abs(ends[-1] - ends[0]) if ends else 0.0
    for part in parts:
        longest = limit / part
        if between <= ROUNDING * longest:
            return longest
        step = between / np.ceil(between / longest - ROUNDING)
        if step >= USED * longest:
            return float(step)
    return limit / parts[0]


def _through(at: float, step: float, low: float, high: float) -> np.ndarray:
    """All angles that are whole steps from `at`, within the range."""
    first = -int((at - low) / step + ROUNDING)
    last = int((high - at) / step + ROUNDING)
    return np.clip(at + step * np.arange(first, last + 1), low, high)


def step_of(angles: Float[np.ndarray, "n"]) -> float:
    """The distance of neighbouring angles [rad]; 0 for one angle."""
    return float(angles[-1] - angles[0]) / max(len(angles) - 1, 1)


def windows_of(
    angles: Float[np.ndarray, "n"], limits: Float[np.ndarray, "k"]
) -> Float[np.ndarray, "k"]:
    """Grid steps that a leg may move in each step of the drive; limits: the longest [rad]."""
    most = len(angles) - 1
    if most == 0:
        return np.zeros(limits.shape)
    return np.minimum(np.floor(limits / step_of(angles) + ROUNDING), most)


def rate_used(angles: Float[np.ndarray, "n"], limits: Float[np.ndarray, "k"]) -> float:
    """The share of its rate that a leg can use on these angles, 0 to 1; 1 where it can reach
    every one of them in a single step."""
    most = len(angles) - 1
    windows = windows_of(angles, limits)
    if most == 0 or np.all(windows == most):
        return 1.0
    return float(min(np.sum(windows) * step_of(angles) / np.sum(limits), 1.0))


def without_path(grid: PostureGrid, k: int, reason: str, common: dict[str, Any]) -> PostureResult:
    """The result where no path leads to waypoint k. common: fields of every result.

    INFEASIBLE where the problem leaves one pair of angles at k, and that breaks a constraint. Else
    FAILED: there are angles off the grid, and a posture that ends in a numerical status
    (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is not known to be impossible.
    """
    layer = grid.layer(k)
    doubtful = ~layer.met["pose"]
    status, message = OptimStatus.FAILED, f"no {grid.what}: {reason}"
    if np.any(doubtful):
        message += f"; {_without_numbers(grid, k, doubtful)}"
    elif len(doubtful) == 1 and not layer.admissible[0]:
        status, message = OptimStatus.INFEASIBLE, f"infeasible: {reason}"
    return PostureResult.without_point(status=status, message=message, **common)


def _without_numbers(grid: PostureGrid, k: int, bad: np.ndarray) -> str:
    """Number of postures of a waypoint with each status, as text."""
    status = grid.layer(k).stations.status[bad]
    codes = np.where(np.isin(status, PLACED), int(Status.NON_FINITE), status)
    counts = Counter(Status(int(code)).name for code in codes)
    listed = ", ".join(f"{n} {name}" for name, n in counts.most_common())
    what = "hollow ground" if set(counts) == {"HOLLOW_GROUND"} else "no pose"
    return f"{what}: {int(np.sum(bad))} of {bad.size} pairs of angles there ended {listed}"


BETTER = 1e-9
"""Relative decrease below which a polished drive is no better than the grid's."""


def polishable(method: Callable[..., PostureResult]) -> Callable[..., PostureResult]:
    """The method of the grid with one more option, polish (False): what `polished` makes of it."""

    @wraps(method)
    def run(
        problem: PostureProblem, *, progress: bool = False, polish: bool = False, **options: Any
    ) -> PostureResult:
        if polish:
            require_room(problem)
        result = method(problem, progress=progress, **options)
        return polished(problem, result, progress) if polish else result

    own = inspect.signature(method)
    more = inspect.signature(run, follow_wrapped=False).parameters["polish"]
    run.__signature__ = own.replace(parameters=[*own.parameters.values(), more])  # type: ignore[attr-defined]
    return run


def require_room(problem: PostureProblem) -> None:
    """Refuse what the polish has no room for, before the grid is searched."""
    K = len(problem.x)
    require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)


def polished(problem: PostureProblem, grid: PostureResult, progress: bool) -> PostureResult:
    """The better of a grid's result and of the local optimum that scp finds from it.

    details: those of the grid, whose grid_bound a drive off it may be below; grid_value and
    grid_angles, of the grid's path; polish, how scp ended. Without a path nothing is polished.
    """
    if grid.x is None:
        return grid
    from stickslip.optim.posture.local.scp import solve_scp

    began = time.perf_counter()
    local = solve_scp(problem, start=grid.x, progress=progress)
    details = dict(grid.details) | {
        "grid_value": grid.value,
        "grid_angles": grid.leg_angles,
        "polish": f"{local.status.name}: {local.message}",
    }
    seconds = grid.seconds + time.perf_counter() - began
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


def moves_of_step(grid: PostureGrid, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The same in parts, one for each move in grid steps; all at once from or to a given pair."""
    good_a, good_b = grid.admissible(step), grid.admissible(step + 1)
    first, last = grid.free
    if step < first or step + 1 >= last:  # from or to a given pair
        a, b = (grid.layer(k).stations.leg_angles for k in (step, step + 1))
        allowed = grid.within(step, a[:, None], b) & good_a[:, None] & good_b
        tail, head = np.nonzero(allowed)
        yield tail, head
        return
    wide = grid.windows()[step]
    R, F = grid.shape
    good_a, good_b = good_a.reshape(R, F), good_b.reshape(R, F)
    for r, f in offsets(grid):
        if abs(r) > wide[0] or abs(f) > wide[1]:
            continue
        rows, columns = slice(max(0, -r), min(R, R - r)), slice(max(0, -f), min(F, F - f))
        to_rows, to_columns = slice(max(0, r), min(R, R + r)), slice(max(0, f), min(F, F + f))
        i, j = np.nonzero(good_a[rows, columns] & good_b[to_rows, to_columns])
        i, j = i + rows.start, j + columns.start
        yield i * F + j, (i + r) * F + j + f
