"""Every pair of leg angles at every waypoint: the grid that `grid`, `dp` and `lp` search."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from stickslip.dynamics.checks import require_integer, require_number, shown
from stickslip.optim.posture.fitting import (
    LEAST,
    ROUNDING,
    fitting_grid,
    rate_used,
    step_of,
    windows_of,
)
from stickslip.optim.posture.sizes import require_grid, require_moves
from stickslip.optim.posture.station import Station
from stickslip.optim.posture.traced import Posture
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.numeric import Number
    from stickslip.optim.posture.problem import PostureProblem

CHUNK = 16_384
"""Stations evaluated in one call, about: what bounds the memory."""


@dataclass(frozen=True)
class PostureGrid:
    """The stations of K waypoints and N pairs of angles, as NumPy arrays.

    rear, front: the angles of each leg [rad]; the pairs are all of one with all of the other, the
    front leg's running faster. stations: [K, N]. start, end: the station [1] of the first and of
    the last pair and what it meets, where they are given: they are then the only choice at their
    waypoints, and need not lie on the grid.
    """

    problem: PostureProblem
    rear: Float[np.ndarray, "R"]
    front: Float[np.ndarray, "F"]
    stations: Station
    ok: dict[str, Bool[np.ndarray, "K N"]]
    """Which stations meet each group of constraints."""
    start: tuple[Station, dict[str, Bool[np.ndarray, "1"]]] | None
    end: tuple[Station, dict[str, Bool[np.ndarray, "1"]]] | None

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
        """How many grid steps the rear and the front leg may move in each step [K-1, 2]."""
        most = [windows_of(angles, self.limits) for angles in (self.rear, self.front)]
        return np.stack(most, -1).astype(np.int32)

    @property
    def details(self) -> dict[str, Any]:
        """What results tell of the grid: how many angles each leg has, and which share of its rate
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
        """Which nodes of waypoint k meet all constraints of a station."""
        return np.all(list(self.layer(k)[1].values()), axis=0)

    def layer(self, k: int) -> tuple[Station, dict[str, Bool[np.ndarray, "n"]]]:
        """The stations that may be chosen at waypoint k, and which constraints they meet."""
        last = len(self.problem.x) - 1
        if k == 0 and self.start is not None:
            return self.start
        if k == last and self.end is not None:
            return self.end
        return self.stations.map(lambda of: of[k]), {n: of[k] for n, of in self.ok.items()}

    @property
    def free(self) -> tuple[int, int]:
        """The first waypoint whose choice is the grid's, and one past the last."""
        return int(self.start is not None), len(self.problem.x) - int(self.end is not None)

    def within(self, step: int, a: Number, b: Number) -> np.ndarray:
        """Whether the rate allows the move from angles a to b [..., 2] in that step."""
        move = np.max(np.abs(np.asarray(b) - np.asarray(a)), -1)
        return move <= self.limits[step] * (1 + ROUNDING)

    def why_none(self, k: int) -> str:
        """Which constraints leave no pair at waypoint k, in words; empty where some are left."""
        met = self.layer(k)[1]
        count = len(next(iter(met.values())))
        if np.any(np.all(list(met.values()), axis=0)):
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
        """Why no node of waypoint k is reached from the `reached` ones of k - 1, in words."""
        none = self.why_none(k)
        if none or k == 0:
            return f"infeasible: {none}"
        left = int(np.sum(self.admissible(k)))
        reason = (
            f"infeasible: leg_rate = {self.problem.leg_rate} rad/m lets none of the "
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
    given = fitting_grid(problem, least) if angles is None else _pair(angles)
    counts = [of if isinstance(of, int) else len(of) for of in given]
    require_grid(problem, counts[0], counts[1], CHUNK)
    rear, front = (_angles_of(problem, of) for of in given)
    pairs = np.stack(np.meshgrid(rear, front, indexing="ij"), -1).reshape(-1, 2)
    K = len(problem.x)
    rows = min(max(1, CHUNK // len(pairs)), K)
    friction = problem.posture.friction
    found = []
    with Bar(method, K, "waypoint", progress) as bar:
        for begin in range(0, K, rows):
            at = np.minimum(np.arange(begin, begin + rows), K - 1)  # all chunks of one shape
            found.append(_evaluate(problem, problem.x[at], friction[at], pairs))
            bar.advance(min(rows, K - begin))
    stations, met = jax.tree.map(lambda *of: np.concatenate(of)[:K], *found)
    ends = []
    for k, given in ((0, problem.start_angles), (-1, problem.end_angles)):
        if given is None:
            ends.append(None)
            continue
        one, of = _evaluate(problem, problem.x[[k]], friction[[k]], given[None])
        ends.append((one.map(lambda of: of[0]), {name: v[0] for name, v in of.items()}))
    return PostureGrid(problem, rear, front, stations, met, *ends)


def _evaluate(
    problem: PostureProblem,
    x: Float[Array | np.ndarray, "rows"],
    friction: Float[Array | np.ndarray, "rows"],
    pairs: Float[np.ndarray, "rows N 2"],
):
    """Stations [rows, N] and which constraints they meet."""
    with jax.enable_x64(True):
        return jax.tree.map(
            np.asarray, _all_pairs(replace(problem.posture, criterion=None), x, friction, pairs)
        )


@jax.jit
def _all_pairs(posture: Posture, x, friction, pairs):
    found = posture.stations_at(x[:, None], friction[:, None], pairs)
    met = {name: (of >= 0).all(-1) for name, of in posture.margins(found).items()}
    return found, met | {"pose": met["pose"] & found.finite}


def _pair(angles: Any) -> tuple[Any, Any]:
    """For each leg a count or the angles themselves."""
    accepted = "an integer >= 2, or for each leg one or its evenly spaced angles [rad]"
    given = angles.tolist() if isinstance(angles, np.ndarray) else angles
    both = given if isinstance(given, tuple | list) else (given, given)
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
    found = np.array(angles, dtype=float)
    steps = np.diff(found)
    if np.any(steps <= 0) or not np.allclose(steps, step_of(found), rtol=1e-6, atol=0):
        raise ValueError(f"angles = {shown(angles)} are not evenly spaced; accepted: {accepted}")
    return found


def _angles_of(problem: PostureProblem, given: Any) -> np.ndarray:
    """The angles [rad] of a count, or those given, which must lie in the legs' range."""
    low, high = float(problem.params.leg_angle_min), float(problem.params.leg_angle_max)
    if isinstance(given, int):
        return np.linspace(low, high, given) if low < high else np.array([low])
    if given[0] < low - ROUNDING or given[-1] > high + ROUNDING:
        raise ValueError(
            f"angles from {given[0]:.6g} to {given[-1]:.6g} rad; accepted: within the legs' range, "
            f"{low:.6g} to {high:.6g} rad"
        )
    return np.clip(given, low, high)


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
