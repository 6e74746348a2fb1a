"""Evaluation of any number of stations by a few compiled programs.

Compiling takes seconds and a thousand stations take half a millisecond. So stations go through in
rows, filled up to SIZES, whatever problem, grid or batch of drives they come from: problems with
ground and vehicle of one structure share programs whose waypoints, angles and limits differ. What
a problem's stations have in common is handed to JAX once (`Waypoints`), and every program gives
one array: a call costs as much as a hundred stations, and more for each array in and out.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.optim.posture.stations.station import Station
from stickslip.optim.posture.stations.traced import Posture, packed
from stickslip.optim.processes import refuse_after_fork

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Bool, Float

    Program = Callable[[Posture, Array, Array, np.ndarray], Array]

SIZES = (40, 128, 1024, 16_384)
"""Stations that go through together; more go through one after another, which bounds the memory."""
A_CALL = 170
"""Stations that take as long as a call takes beside its stations."""


class Waypoints(NamedTuple):
    """Shared data of one row of stations, on the device."""

    shared: Posture
    """Vehicle, ground and solver."""
    calls: tuple[tuple[int, int, Array, Array], ...]
    """Calls: start in the row, size, and x and friction [size]."""
    length: int
    """Length of the row."""

    @classmethod
    def of(
        cls,
        posture: Posture,
        x: Float[Array | np.ndarray, "length"],
        friction: Float[Array | np.ndarray, "length"],
    ) -> Waypoints:
        """Waypoints of stations, each with its x [m] and mu [-]."""
        x, friction = np.asarray(x), np.asarray(friction)
        names = ("x", "friction", "leg_rate", "criterion")
        names += ("min_normal", "min_grip", "min_clearance", "min_wheel_clearance", "max_torque")
        calls = [
            (begin, size, padded(x[begin : begin + size], size), padded(friction[begin:], size))
            for begin, size in _calls(len(x))
        ]
        with jax.enable_x64(True):
            shared = replace(posture, **dict.fromkeys(names))
            shared, rows = jax.device_put((shared, [of[2:] for of in calls]))
        made = tuple((*of[:2], *row) for of, row in zip(calls, rows, strict=True))
        return cls(shared, made, len(x))

    def stations(self, pairs: Float[np.ndarray, "length 2"]) -> Float[np.ndarray, "rows length"]:
        """The stations at these angles, as Station.unpacked reads them."""
        return self._rows(_stations, pairs)

    def with_slopes(self, pairs: Float[np.ndarray, "length 2"]) -> Float[np.ndarray, "rows length"]:
        """The same and their slopes in both angles, as Station.unpacked_with_slopes reads them."""
        return self._rows(_slopes, pairs)

    def _rows(self, program: Program, pairs: np.ndarray) -> np.ndarray:
        refuse_after_fork()
        with jax.enable_x64(True):
            parts = [
                np.asarray(program(self.shared, x, friction, padded(pairs[begin:], size)))
                for begin, size, x, friction in self.calls
            ]
        rows = parts[0] if len(parts) == 1 else np.concatenate(parts, axis=-1)
        return rows[:, : self.length]


def stations(posture: Posture, angles: Float[np.ndarray, "... K 2"]) -> Station:
    """`Posture.stations` of any batch of drives [..., K], as NumPy arrays."""
    return stations_at(posture, posture.x, posture.friction, angles)


def stations_at(
    posture: Posture,
    x: Float[Array | np.ndarray, "..."],
    friction: Float[Array | np.ndarray, "..."],
    angles: Float[np.ndarray, "... 2"],
) -> Station:
    """`Posture.stations_at`, broadcast, as NumPy arrays."""
    return Station.unpacked(rows_at(posture, x, friction, angles))


def rows_at(
    posture: Posture,
    x: Float[Array | np.ndarray, "..."],
    friction: Float[Array | np.ndarray, "..."],
    angles: Float[np.ndarray, "... 2"],
) -> Float[np.ndarray, "rows ..."]:
    """The same as Station.unpacked reads them."""
    x, friction, angles = map(np.asarray, (x, friction, angles))
    shape = np.broadcast_shapes(x.shape, friction.shape, angles.shape[:-1])
    each = [np.broadcast_to(of, shape).reshape(-1) for of in (x, friction)]
    pairs = np.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)
    rows = Waypoints.of(posture, *each).stations(pairs)
    return rows.reshape(len(rows), *shape)


def stations_and_slopes(
    posture: Posture, angles: Float[np.ndarray, "K 2"]
) -> tuple[Station, Station]:
    """The stations and their slopes in their own two angles: a last axis of 2; status left 0."""
    given = Waypoints.of(posture, posture.x, posture.friction)
    return Station.unpacked_with_slopes(given.with_slopes(angles))


def met(posture: Posture, at: Station) -> dict[str, Bool[np.ndarray, "..."]]:
    """Mask of stations [...] that meet each group of constraints; `pose` asks for finite numbers,
    too."""
    shape = at.torque.shape
    rows = jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[len(shape) :]), at)
    shared = replace(posture, x=None, friction=None, criterion=None)
    parts = []
    with jax.enable_x64(True):
        for begin, size in _calls(len(rows.torque)):
            part = jax.tree.map(lambda of, b=begin, s=size: padded(of[b : b + s], s), rows)
            parts.append(jax.tree.map(np.asarray, _met(shared, part)))
    whole = jax.tree.map(lambda *of: np.concatenate(of)[: len(rows.torque)], *parts)
    return {name: of.reshape(shape) for name, of in whole.items()}


def padded(rows: np.ndarray, size: int) -> np.ndarray:
    """The first of them up to that many, filled up with the last."""
    if len(rows) >= size:
        return rows[:size]
    filled = np.empty((size, *rows.shape[1:]), rows.dtype)
    filled[: len(rows)], filled[len(rows) :] = rows, rows[-1]
    return filled


def _calls(count: int) -> list[tuple[int, int]]:
    """Start and size of each call, for so many stations."""
    whole, rest = divmod(count, SIZES[-1])
    sizes = (*[SIZES[-1]] * whole, *_sizes(rest))
    begins = np.cumsum((0, *sizes)).tolist()
    return list(zip(begins, sizes, strict=False))


@lru_cache
def _sizes(count: int) -> tuple[int, ...]:
    """The calls that take least together: one that is too large, or several smaller ones."""
    if count <= 0:
        return ()
    one = (next(size for size in SIZES if size >= count),)
    smaller = [size for size in SIZES if size < count]
    if not smaller:
        return one
    several = (smaller[-1], *_sizes(count - smaller[-1]))
    return min(one, several, key=lambda sizes: sum(sizes) + A_CALL * len(sizes))


@jax.jit
def _stations(posture: Posture, x: Array, friction: Array, angles: Array) -> Array:
    return packed(posture, x, friction, angles)


@jax.jit
def _slopes(posture: Posture, x: Array, friction: Array, angles: Array) -> Array:
    return packed(posture, x, friction, angles, slopes=True)


@jax.jit
def _met(posture: Posture, at: Station) -> dict[str, Array]:
    met = {name: (of >= 0).all(-1) for name, of in posture.margins(at).items()}
    return met | {"pose": met["pose"] & at.finite}
