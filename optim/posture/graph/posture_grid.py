"""Every pair of leg angles at every waypoint: the grid that `grid`, `dp` and `lp` search."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.checks import require_integer, require_number, shown
from stickslip.optim.posture.graph.fitting import (
    LEAST,
    ROUNDING,
    fitting_grid,
    rate_used,
    step_of,
    windows_of,
)
from stickslip.optim.posture.sizes import require_grid, require_moves
from stickslip.optim.posture.stations import evaluated
from stickslip.optim.posture.stations.station import Station
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.dynamics.numeric import Number
    from stickslip.optim.posture.problem import PostureProblem

CHUNK = evaluated.SIZES[-1]
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
    at = evaluated.stations_at(problem.posture, x[:, None], friction[:, None], pairs)
    return Layer(at, evaluated.met(problem.posture, at))


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
