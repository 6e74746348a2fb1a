"""Every pair of leg angles at every waypoint: the grid that `grid`, `dp` and `lp` search."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.checks import require_integer, require_memory, shown
from stickslip.dynamics.status import Status
from stickslip.optim.options import COUNT
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.result import PostureResult
from stickslip.optim.posture.station import PLACED, Station
from stickslip.optim.posture.waypoints import CONVEX, MOVE, require_grid
from stickslip.optim.progress import Bar
from stickslip.optim.result import OptimStatus

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

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

    method, began: who searches it, and since when. rear, front: the angles of each leg [rad]; the
    pairs are all of one with all of the other, the front leg's running faster. layers: the choices
    at each waypoint; one, which need not lie on the grid, where the first or the last pair is
    given.
    """

    problem: PostureProblem
    method: str
    began: float
    rear: Float[np.ndarray, "R"]
    front: Float[np.ndarray, "F"]
    layers: list[Layer]

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of angles of the rear and the front leg."""
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

    def angles_at(self, nodes: np.ndarray) -> Float[np.ndarray, "K 2"]:
        """The angles of a path given by its nodes."""
        each = zip(self.layers, nodes, strict=True)
        return np.stack([layer.stations.leg_angles[node] for layer, node in each])

    def edges(self, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Nodes before and after each admissible move of a step, in parts: one for each move in
        grid steps, the shortest first; all in one from or to a given pair."""
        a, b = self.layers[step : step + 2]
        R, F = self.shape
        if len(a.admissible) != R * F or len(b.admissible) != R * F:
            turn = np.abs(b.stations.leg_angles - a.stations.leg_angles[:, None])
            near = np.max(turn, -1) <= self.limits[step] * (1 + ROUNDING)
            tail, head = np.nonzero(near & a.admissible[:, None] & b.admissible)
            yield tail, head
            return
        nodes = np.arange(R * F).reshape(R, F)
        for r, f in self._moves(*self.windows[step].tolist()):
            within = slice(max(0, -r), min(R, R - r)), slice(max(0, -f), min(F, F - f))
            tail = nodes[within].ravel()
            head = tail + r * F + f
            good = a.admissible[tail] & b.admissible[head]
            yield tail[good], head[good]

    def _moves(self, rear: int, front: int) -> list[tuple[int, int]]:
        """Moves of up to so many grid steps, the shortest first."""
        given = f"leg_rate = {self.problem.leg_rate} rad/m on this grid"
        require_memory(given, "moves", (2.0 * rear + 1) * (2.0 * front + 1), MOVE)
        both = [(r, f) for r in range(-rear, rear + 1) for f in range(-front, front + 1)]
        return sorted(both, key=lambda move: (abs(move[0]) + abs(move[1]), move))

    def why_none(self, k: int) -> str:
        """Text of the constraints that leave no pair at waypoint k; empty where some are left."""
        met, good = self.layers[k].met, self.layers[k].admissible
        if np.any(good):
            return ""
        broken = {name: int(np.sum(~of)) for name, of in met.items() if not np.all(of)}
        each = ", ".join(f"{name} rules out {n} of {len(good)}" for name, n in broken.items())
        where = f"at waypoint {k} (x = {self.problem.x[k]:.6g} m)"
        return f"{where} no pair of angles meets all constraints: {each}"

    def why_stuck(self, k: int) -> str:
        """Text of why no path reaches waypoint k, where one reaches k - 1."""
        none = self.why_none(k)
        if none or k == 0:
            return none
        if self.problem.leg_rate is None:
            return f"the criterion is not finite at waypoint {k} on any of them"
        return (
            f"leg_rate = {self.problem.leg_rate} rad/m lets none of the pairs that are reached at "
            f"waypoint {k - 1} move to an admissible one at waypoint {k} "
            f"(x = {self.problem.x[k]:.6g} m) on this grid. {self.stuck}"
        ).rstrip()

    def result(
        self, nodes: np.ndarray, status: OptimStatus, message: str, **details: Any
    ) -> PostureResult:
        """The result of a path. details: besides the number of angles of each leg and the share of
        its rate that it can use on them."""
        used = tuple(rate_used(angles, self.limits) for angles in (self.rear, self.front))
        return self.problem.result(
            self.angles_at(nodes),
            status=status,
            message=message,
            details={"grid": self.shape, "rate_used": used} | details,
            **self._common,
        )

    @property
    def _common(self) -> dict[str, Any]:
        """Fields of every result."""
        count = sum(len(layer.admissible) for layer in self.layers)
        return {"method": self.method, "began": self.began, "evaluations": count}

    def without_answer(
        self, message: str, status: OptimStatus = OptimStatus.FAILED
    ) -> PostureResult:
        """The result without a path."""
        return PostureResult.without_point(status=status, message=message, **self._common)

    def without_path(self, k: int, reason: str) -> PostureResult:
        """The result where no path leads to waypoint k.

        INFEASIBLE where the problem leaves one pair of angles at k, and that breaks a constraint.
        Else FAILED: there are angles off the grid, and a posture that ends in a numerical status
        (NOT_CONVERGED, HOLLOW_GROUND, NO_SOLUTION, NON_FINITE) is not known to be impossible.
        """
        layer = self.layers[k]
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
        return self.without_answer(message, status)


def build_grid(
    problem: PostureProblem, angles: Any, least: int, method: str, progress: bool
) -> PostureGrid:
    """Evaluate all stations in float64.

    angles: how many for each leg, evenly spaced over its range, an integer or a pair; or None for
    `fitting_grid`, with `least` of each leg.
    """
    began = time.perf_counter()
    rear, front = _angles(problem, angles, least)
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
    return PostureGrid(problem, method, began, rear, front, layers)


def _evaluate(
    problem: PostureProblem, at: np.ndarray, pairs: Float[np.ndarray, "N 2"]
) -> list[Layer]:
    """Stations of those waypoints and which constraints they meet."""
    x, friction = problem.x[at], problem.posture.friction[at]
    rows = evaluate.rows_at(problem.posture, x[:, None], friction[:, None], pairs)
    whole = Layer(Station.unpacked(rows), evaluate.met(problem.posture, rows))
    return [jax.tree.map(lambda of, i=i: of[i], whole) for i in range(len(at))]


def _angles(
    problem: PostureProblem, angles: Any, least: Any
) -> tuple[Float[np.ndarray, "R"], Float[np.ndarray, "F"]]:
    """The angles of each leg [rad]; ValueError for bad counts, or more stations than fit."""
    least = require_integer("least", least, low=2, high=COUNT)
    if angles is None:
        rear, front = fitting_grid(problem, least)
        require_grid(problem, len(rear), len(front), CHUNK)
        return rear, front
    accepted = "None, or an integer >= 2, or one for each leg"
    both = angles if isinstance(angles, tuple | list) else (angles, angles)
    if len(both) != 2:
        raise ValueError(f"angles = {shown(angles)}; accepted: {accepted}")
    R, F = (require_integer("angles", of, low=2, accepted=accepted) for of in both)
    require_grid(problem, R, F, CHUNK)
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    rear, front = (np.linspace(low, high, of if low < high else 1) for of in (R, F))
    return rear, front


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
        at = ends[0] if ends else (below + above) / 2
        first, last = -int((at - below) / step + ROUNDING), int((above - at) / step + ROUNDING)
        return np.clip(at + step * np.arange(first, last + 1), below, above)
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
    windows = windows_of(angles, limits)
    if np.all(windows == len(angles) - 1):
        return 1.0
    return float(min(np.sum(windows) * step_of(angles) / np.sum(limits), 1.0))


def polished(
    problem: PostureProblem, polish: bool, progress: bool, search: Callable[[], PostureResult]
) -> PostureResult:
    """The result of a search of the grid; with polish the better of it and of the local optimum
    that scp finds from it.

    details: those of the grid, whose grid_bound a drive off it may be below; grid_value and
    grid_angles, of the grid's path; polish, how scp ended. Without a path nothing is polished.
    """
    if not polish:
        return search()
    K = len(problem.x)
    require_memory(f"polish = True with {K} waypoints", "rows of a convex program", K, CONVEX)
    grid = search()
    if grid.x is None:
        return grid
    from stickslip.optim.posture.local.scp import solve_scp

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
