"""Grids over few coordinates, sheet by sheet, with multilinear interpolation.

A sheet is a box of coordinates with nodes along each axis. A system that changes its kind has a
sheet for each: a foot at rest needs no axis for its velocity, and nothing is interpolated between
rest and sliding, across which values jump.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_integer, require_number, shown
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from collections.abc import Iterator

    from jaxtyping import Array, Bool, Float, Int

SLACK = 1e-3
"""Share of an outermost cell by which rounding may leave the grid."""
MOST_RANK = 6
"""Coordinates of a sheet; a cell of it has 2^6 corners."""


@register_pytree
@dataclass(frozen=True)
class Axis:
    """Nodes along one coordinate, ascending. Other nodes compile nothing, another count does.

    periodic: the coordinate wraps, and the last node is the first one again. unit: for people.
    """

    name: str = field(metadata={"static": True})
    nodes: np.ndarray | Float[Array, " nodes"]
    periodic: bool = field(default=False, metadata={"static": True})
    unit: str = field(default="-", metadata={"static": True})

    def validate(self) -> Axis:
        """Return self, or raise ValueError naming the axis and its error."""
        accepted = "finite numbers in ascending order, at least two, of shape [nodes]"
        require_number(f"nodes of {self.name}", self.nodes, accepted=accepted)
        if not is_concrete(self.nodes):
            return self
        shape = np.shape(self.nodes)
        if len(shape) != 1 or shape[0] < 2 or np.any(np.diff(np.asarray(self.nodes)) <= 0):
            raise ValueError(f"nodes of {self.name} = {shown(self.nodes)}; accepted: {accepted}")
        return self

    @classmethod
    def even(cls, name: str, low: float, high: float, cells: int, **how: Any) -> Axis:
        """Axis with cells of one width. how: periodic, unit."""
        require_integer(f"cells of {name}", cells, high=10**7)
        return cls(name, np.linspace(low, high, cells + 1), **how).validate()

    @property
    def count(self) -> int:
        """Nodes."""
        return np.size(self.nodes)

    def cell(
        self, at: Float[Array, ""]
    ) -> tuple[Int[Array, ""], Float[Array, ""], Bool[Array, ""]]:
        """The cell's first node, the share of the cell before `at`, and whether that is outside;
        there the nearest end stands for it. NaN is outside."""
        nodes = jnp.asarray(self.nodes, at.dtype)
        if self.periodic:
            at = nodes[0] + jnp.mod(at - nodes[0], nodes[-1] - nodes[0])
        index = jnp.clip(jnp.searchsorted(nodes, at, side="right") - 1, 0, self.count - 2)
        share = (at - nodes[index]) / (nodes[index + 1] - nodes[index])
        inside = (share >= -SLACK) & (share <= 1 + SLACK)
        share = jnp.where(inside, jnp.clip(share, 0.0, 1.0), jnp.where(share > 1, 1.0, 0.0))
        return index.astype(jnp.int32), share, ~inside


class Cell(NamedTuple):
    """Cell of a grid that holds a state."""

    base: Int[Array, ""]
    """Number of the corner from which all axes ascend."""
    share: Float[Array, " rank"]
    """Position in the cell along each axis, in [0, 1]; 0 along axes that the sheet lacks."""
    outside: Bool[Array, ""]
    """True if the grid does not cover it; the cell is then the nearest one."""


class Place(NamedTuple):
    """A state's sheet and its coordinates there, filled up with zeros to the grid's rank."""

    sheet: Int[Array, ""]
    coordinates: Float[Array, " rank"]


@register_pytree
@dataclass(frozen=True)
class Sheet:
    """A box of coordinates with nodes along each axis."""

    name: str = field(metadata={"static": True})
    axes: tuple[Axis, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Nodes along each axis."""
        return tuple(axis.count for axis in self.axes)

    @property
    def size(self) -> int:
        """Nodes."""
        return math.prod(self.shape)

    @property
    def strides(self) -> tuple[int, ...]:
        """Numbers of nodes from one to the next along each axis; the last axis runs fastest."""
        return tuple(math.prod(self.shape[at + 1 :]) for at in range(len(self.axes)))

    def coordinates(self) -> np.ndarray:
        """Coordinates of every node [size, axes]."""
        along = np.meshgrid(*(np.asarray(axis.nodes) for axis in self.axes), indexing="ij")
        return np.stack([one.ravel() for one in along], 1)


@register_pytree
@dataclass(frozen=True)
class Grid:
    """Sheets, whose nodes are numbered one after the other."""

    sheets: tuple[Sheet, ...]

    def validate(self) -> Grid:
        """Return self, or raise ValueError naming the sheet or the axis."""
        for sheet in self.sheets:
            for axis in sheet.axes:
                axis.validate()
            if not 1 <= len(sheet.axes) <= MOST_RANK:
                raise ValueError(
                    f"{len(sheet.axes)} axes of {sheet.name}; accepted: 1 to {MOST_RANK}"
                )
        return self

    @property
    def rank(self) -> int:
        """Axes of the sheet that has most."""
        return max(len(sheet.axes) for sheet in self.sheets)

    @property
    def size(self) -> int:
        """Nodes of all sheets."""
        return sum(sheet.size for sheet in self.sheets)

    @property
    def offsets(self) -> tuple[int, ...]:
        """Number of each sheet's first node."""
        sizes = [sheet.size for sheet in self.sheets]
        return tuple(sum(sizes[:at]) for at in range(len(sizes)))

    def in_words(self) -> str:
        """Its sheets and their nodes."""
        parts = [f"{one.name} {' x '.join(map(str, one.shape))}" for one in self.sheets]
        return f"{', '.join(parts)}: {self.size:,} nodes"

    def place(self, sheet: Int[Array, ""] | int, *coordinates: Float[Array, ""]) -> Place:
        """A place of coordinates of one type, filled up."""
        kind = coordinates[0].dtype
        rest = [jnp.zeros((), kind)] * (self.rank - len(coordinates))
        return Place(jnp.asarray(sheet, jnp.int32), jnp.stack([*coordinates, *rest]))

    def cell(self, place: Place) -> Cell:
        """The cell of a place. A sheet that the grid has not is outside."""
        found = [self._cell_on(index, place) for index in range(len(self.sheets))]
        cell = found[0]
        for index, other in enumerate(found[1:], 1):
            here = place.sheet == index
            cell = Cell(*(jnp.where(here, a, b) for a, b in zip(other, cell, strict=True)))
        unknown = (place.sheet < 0) | (place.sheet >= len(self.sheets))
        return cell._replace(outside=cell.outside | unknown)

    def read(self, values: Float[Array, " nodes"], cell: Cell) -> Float[Array, ""]:
        """The values' multilinear interpolation in a cell."""
        total = jnp.zeros((), values.dtype)
        for step, weight in self.corners(cell.base, cell.share):
            total = total + weight * values[cell.base + step]
        return total

    def corners(
        self, base: Int[Array, "*n"], share: Float[Array, "*n rank"]
    ) -> Iterator[tuple[Int[Array, "*n"], Float[Array, "*n"]]]:
        """Index offset and weight of each corner of the cells; a corner along an axis that a sheet
        lacks is the one before it."""
        bounds = jnp.asarray(self.offsets, jnp.int32)
        sheet = jnp.sum(base[..., None] >= bounds[1:], -1)
        for corner in product((0, 1), repeat=self.rank):
            table = [
                sum(up * stride for up, stride in zip(corner, one.strides, strict=False))
                for one in self.sheets
            ]
            step = jnp.asarray(table, jnp.int32)[sheet]
            weight = jnp.ones(share.shape[:-1], share.dtype)
            for axis, up in enumerate(corner):
                weight = weight * (share[..., axis] if up else 1 - share[..., axis])
            yield step, weight

    def _cell_on(self, index: int, place: Place) -> Cell:
        sheet = self.sheets[index]
        base = jnp.asarray(self.offsets[index], jnp.int32)
        outside = jnp.zeros((), bool)
        shares = [jnp.zeros((), place.coordinates.dtype)] * self.rank
        for at, (axis, stride) in enumerate(zip(sheet.axes, sheet.strides, strict=True)):
            node, shares[at], beyond = axis.cell(place.coordinates[at])
            base = base + stride * node
            outside = outside | beyond
        return Cell(base, jnp.stack(shares), outside)
