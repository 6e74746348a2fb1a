"""The stations of a grid of leg angles, waypoint by waypoint, a block of waypoints at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.optim.posture import evaluate
from stickslip.optim.posture.criteria import Station

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

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
    """The layers of all waypoints, evaluated a block of waypoints at a time when they are asked
    for; only the last two blocks are kept."""

    def __init__(self, problem: PostureProblem, pairs: Float[np.ndarray, "N 2"]):
        self._problem, self._pairs = problem, pairs
        self._rows = min(max(1, CHUNK // len(pairs)), len(problem.x))
        self._blocks: dict[int, list[Layer]] = {}
        self._ends: dict[int, Layer] = {}
        for k, pair in ((0, problem.start_angles), (len(self) - 1, problem.end_angles)):
            if pair is not None:
                self._ends[k] = _evaluate(problem, np.array([k]), pair[None])[0]

    def __len__(self) -> int:
        return len(self._problem.x)

    def __getitem__(self, k: int) -> Layer:  # pyright: ignore[reportIncompatibleMethodOverride]
        if not 0 <= k < len(self):
            raise IndexError(k)
        if k in self._ends:
            return self._ends[k]
        block, row = divmod(k, self._rows)
        if block not in self._blocks:
            begin = block * self._rows
            at = np.arange(begin, min(begin + self._rows, len(self)))
            kept = {block - 1: self._blocks[block - 1]} if block - 1 in self._blocks else {}
            self._blocks = kept | {block: _evaluate(self._problem, at, self._pairs)}
        return self._blocks[block][row]


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
