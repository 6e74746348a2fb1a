"""One end of a step: its waypoint's cells in a row, with what the costs of moves need of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.optim.intervals.arithmetic import Interval, interval

if TYPE_CHECKING:
    from jaxtyping import Bool, Float

    from stickslip.optim.posture.bounds.lattice import Axis
    from stickslip.optim.posture.bounds.station_cells import StationCells
    from stickslip.optim.posture.bounds.terms import Term

FOUR = ((0, 0), (0, 1), (1, 0), (1, 1))
"""A cell's corners: rear and front."""


class Field(NamedTuple):
    """A field over n cells: at their corners, over all of each, and its derivatives there."""

    corners: Float[np.ndarray, "n 4"]
    over: Interval
    first: Interval
    """[2, n], as second."""
    second: Interval
    radius: float
    """Greatest error of a corner."""

    def of(self, cells: np.ndarray) -> Field:
        """Field of those cells."""
        parts = (self.over[cells], self.first[:, cells], self.second[:, cells])
        return Field(self.corners[cells], *parts, self.radius)


@dataclass(frozen=True)
class Side:
    """The cells of a waypoint within the least rectangle that holds those that are alive, n in all,
    row by row."""

    rear: Axis
    front: Axis
    alive: Bool[np.ndarray, "R F"]
    known: Bool[np.ndarray, "n"]
    smooth: Bool[np.ndarray, "n"]
    widths: Float[np.ndarray, "2 n"]
    fields: dict[str, Field]
    box: tuple[slice, slice]
    """Position of the rectangle among all cells."""

    @classmethod
    def of(cls, cells: StationCells, terms: list[Term]) -> Side:
        """Side of a waypoint's cells; one of them at least is alive."""
        rows, columns = np.nonzero(cells.alive)
        box = (slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1))
        rear, front = (
            axis.part(of) for axis, of in zip((cells.rear, cells.front), box, strict=True)
        )
        alive = cells.alive[box]
        widths = np.stack(np.meshgrid(rear.widths, front.widths, indexing="ij")).reshape(2, -1)
        known, smooth = (of[box].ravel() for of in (cells.inside.known, cells.inside.smooth))
        names = {name for term in terms for name in (term.X, term.Y) if name}
        fields = {name: _field(cells, name, box) for name in names}
        return cls(rear, front, alive, known & alive.ravel(), smooth, widths, fields, box)


def _field(cells: StationCells, name: str, box: tuple[slice, slice]) -> Field:
    shape = cells.alive[box].shape
    if name in ("rear", "front"):
        return _angle(cells, int(name == "front"), box)
    counts = (cells.inside.known & cells.alive)[box].ravel()

    def row(of: np.ndarray) -> np.ndarray:
        found = of[(..., *box)].reshape(*of.shape[:-2], -1)
        return np.where(counts, found, 0.0)

    first, second = (part[name].map(row) for part in (cells.inside.first, cells.inside.second))
    with np.errstate(invalid="ignore"):
        over = cells.range_of(name).map(row)
    at = cells.values[name]
    corners = [at[i : i + at.shape[0] - 1, j : j + at.shape[1] - 1][box] for i, j in FOUR]
    values = np.stack(corners, -1).reshape(shape[0] * shape[1], 4)
    return Field(values, over, first, second, cells.radii[name])


def _angle(cells: StationCells, leg: int, box: tuple[slice, slice]) -> Field:
    """A leg angle itself."""
    nodes = (cells.rear, cells.front)[leg].nodes
    low, high = nodes[:-1][box[leg]], nodes[1:][box[leg]]
    shape = cells.alive[box].shape
    along = (slice(None), None) if leg == 0 else (None, slice(None))
    low, high = (np.broadcast_to(of[along], shape).ravel() for of in (low, high))
    corners = np.stack([(low, high)[pair[leg]] for pair in FOUR], -1)
    zero, one = np.zeros(low.size), np.ones(low.size)
    first = np.stack([one, zero] if leg == 0 else [zero, one])
    return Field(corners, Interval(low, high), interval(first), interval(0 * first), 0.0)
