"""The stations of a grid of leg angles, waypoint by waypoint, a block of waypoints at a time.

And why no drive over a grid meets the constraints: where, which, and the drive that misses least.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.ndimage import minimum_filter

from stickslip.dynamics.pytrees import float64_program
from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import Station
from stickslip.optim.posture.evaluate import Posture, tolerated
from stickslip.optim.posture.waypoints import ROUNDING, slopes_at
from stickslip.optim.problem import FEASIBLE, padded
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float

    from stickslip.optim.posture.problem import PostureProblem


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


class Layers(Sequence[Layer]):
    """The layers of all waypoints, evaluated a block of waypoints at a time.

    The next one is evaluated in a thread meanwhile; of the others only the last two are kept.
    """

    def __init__(self, problem: PostureProblem, pairs: Float[np.ndarray, "N 2"]):
        self._problem, self._pairs = problem, pairs
        self._rows = min(max(1, CHUNK // len(pairs)), len(problem.x))
        self._blocks: dict[int, Future[list[Layer]]] = {}
        self._thread = ThreadPoolExecutor(1)
        self._ends = {
            k: _evaluate(problem, np.array([k]), pair[None])[0]
            for k in (0, len(self) - 1)
            if (pair := problem.given_at(k)) is not None
        }

    def __len__(self) -> int:
        return len(self._problem.x)

    def __getitem__(self, k: int) -> Layer:  # pyright: ignore[reportIncompatibleMethodOverride]
        if not 0 <= k < len(self):
            raise IndexError(k)
        if k in self._ends:
            return self._ends[k]
        block, row = divmod(k, self._rows)
        self._blocks = {b: of for b, of in self._blocks.items() if -1 <= b - block <= 2}
        for b in (block, block + 1):
            if b not in self._blocks and b * self._rows < len(self):
                self._blocks[b] = self._thread.submit(self._block, b)
        return self._blocks[block].result()[row]

    def _block(self, block: int) -> list[Layer]:
        at = padded(np.arange(len(self)), self._rows, block * self._rows)
        return _evaluate(self._problem, at, self._pairs)


def _evaluate(
    problem: PostureProblem, at: np.ndarray, pairs: Float[np.ndarray, "N 2"]
) -> list[Layer]:
    """Stations of those waypoints and which constraints they meet."""
    x, friction = problem.x[at], problem.posture.friction[at]
    rows = evaluate.rows_at(problem.posture, x[:, None], friction[:, None], pairs)
    stations = Station.of_rows(rows)
    whole = Layer(stations, evaluate.met(problem.posture, stations))
    return [jax.tree.map(lambda of, i=i: of[i], whole) for i in range(len(at))]


def shortfall(grid: Any, progress: bool) -> dict[str, Any]:
    """What a PostureGrid without an admissible path lacks.

    blocked: [n, 2] first and last places of the front wheel [m] where no pair of angles meets the
    constraints of a station. closest: the leg angles [K, 2] of the path within the leg rates whose
    scaled violations, the largest of each waypoint, have the least sum; None where postures or the
    rate let none through. misses: by constraint, the worst violation on it [own unit] and its place
    [m]. least_friction: with which a path would meet all constraints, for one friction everywhere;
    None where none would, or with min_normal and a free split, where it is not known. steepest:
    the greatest slope angle of the ground [rad] and its place [m], between knots, too.
    """
    blocked, totals, needed = _passed(grid, progress)
    closest = grid.angles_at(_back(grid, totals)) if np.any(np.isfinite(totals[-1])) else None
    x, cells = grid.problem.x, grid.problem.posture.odometer
    edges = np.asarray(cells.edges, np.float64) + np.asarray(cells.rests, np.float64)
    places = np.concatenate([edges, (edges[1:] + edges[:-1]) / 2])
    places = places[(x[0] <= places) & (places <= x[-1])]
    slopes = np.arctan(np.abs(slopes_at(grid.problem.track, places)))
    runs = np.split(blocked, np.flatnonzero(np.diff(blocked) > 1) + 1) if len(blocked) else []
    simple = np.ndim(grid.problem.friction) == 0 and grid.problem.track.surface is None
    simple &= not (grid.problem.free_split and grid.problem.min_normal)
    return {
        "blocked": np.array([[x[run[0]], x[run[-1]]] for run in runs]).reshape(-1, 2),
        "closest": closest,
        "misses": {} if closest is None else _misses(grid.problem, closest),
        "least_friction": needed if simple and np.isfinite(needed) else None,
        "steepest": (float(np.max(slopes)), float(places[np.argmax(slopes)])),
    }


@float64_program
def _scaled(posture: Posture, at: Station) -> tuple[dict[str, Array], Array]:
    """Least scaled margin of each group [N], and friction needed, infinite where others fail."""
    margins = {name: jnp.min(of, axis=-1) for name, of in posture.margins(at).items()}
    placed = margins.pop("pose") > 0
    margins = {name: jnp.where(placed & at.finite, of, -jnp.inf) for name, of in margins.items()}
    grip = posture.min_grip - FEASIBLE * posture.params.weight
    needed = [jnp.where(N > 0, (abs(F) + grip) / N, jnp.inf) for F, N, _ in at.wheels]
    least = jnp.min(jnp.stack([of for name, of in margins.items() if name != "grip"]), axis=0)
    return margins, jnp.where(least >= -FEASIBLE, jnp.maximum(jnp.maximum(*needed), 0.0), jnp.inf)


def _passed(grid: Any, progress: bool) -> tuple[np.ndarray, list[Float[np.ndarray, "N"]], float]:
    """Blocked waypoints, least sums of violations to each node, and least friction of a path."""
    blocked: list[int] = []
    totals: list[np.ndarray] = []
    needs, freed = np.zeros(0), None
    if grid.problem.free_split:  # without friction the split is the one that needs least
        freed = Layers(replace(grid.problem, friction=0.0), grid.pairs)
    with Bar(f"{grid.method}: what misses least", len(grid.layers), "waypoint", progress) as bar:
        for k, layer in enumerate(grid.layers):
            margins, need = _scaled(grid.problem.limits, layer.stations)
            need = need if freed is None else _scaled(grid.problem.limits, freed[k].stations)[1]
            miss = np.max([np.maximum(-of, 0.0) for of in margins.values()], axis=0)
            if not np.any(layer.admissible):
                blocked.append(k)
            if k:
                miss = miss + _least_before(grid, k, totals[-1])
                need = np.maximum(need, _least_before(grid, k, needs))
            totals.append(miss.astype(np.float32))
            needs = need
            bar.advance()
    return np.array(blocked, dtype=int), totals, float(np.min(needs))


def _least_before(grid: Any, k: int, values: np.ndarray) -> np.ndarray:
    """Least value at the nodes from which the rate lets the legs arrive at each node of k."""
    if len(values) == len(grid.layers[k].admissible) == grid.shape[0] * grid.shape[1]:
        size = 2 * grid.windows[k - 1] + 1
        found = minimum_filter(values.reshape(grid.shape), size, mode="constant", cval=np.inf)
        return found.reshape(-1)
    return np.min(np.where(grid.near(k - 1), values[:, None], np.inf), axis=0)


def _back(grid: Any, totals: list[Float[np.ndarray, "N"]]) -> list[int]:
    """Nodes of the path with the least sum; of equal ones those with the shortest moves."""
    nodes = [int(np.argmin(totals[-1]))]
    for k in range(len(totals) - 1, 0, -1):
        here, there = (grid.choices(j) for j in (k, k - 1))
        move = np.max(np.abs(there - here[nodes[-1] if len(here) > 1 else 0]), axis=1)
        near = move <= grid.problem.longest_moves[k - 1] * (1 + ROUNDING)
        least = np.min(totals[k - 1], where=near, initial=np.inf)
        best = near & (totals[k - 1] <= least)
        nodes.append(int(np.argmin(np.where(best, move, np.inf))))
    return nodes[::-1]


def _misses(problem: PostureProblem, angles: np.ndarray) -> dict[str, tuple[float, float]]:
    """Worst violation of each of a drive's limits, in its unit, and place [m]; largest first."""
    margins, _ = _scaled(problem.limits, problem.stations(angles.reshape(-1)))
    worst = {name: int(np.argmin(of)) for name, of in margins.items()}
    return {
        name: (-by * tolerated(problem, name) / FEASIBLE, float(problem.x[worst[name]]))
        for by, name in sorted((float(margins[name][k]), name) for name, k in worst.items())
        if by < -FEASIBLE
    }
