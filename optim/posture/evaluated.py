"""Stations of numbers at hand: any number of them by a few compiled programs.

Compiling takes seconds and a thousand stations take a millisecond. So stations go through in one
row, filled up to the next of SIZES, whatever problem, grid or batch of drives they come from:
problems with ground and vehicle of one structure share programs whose waypoints, angles and limits
differ.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.optim.posture.traced import Posture

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Bool, Float

    from stickslip.optim.posture.station import Station

Result = TypeVar("Result")

SIZES = (64, 1024, 16_384)
"""Stations that go through together; more go through one after another, which bounds the memory."""


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
    return _by_station(_stations, posture, x, friction, angles)


def stations_and_slopes(
    posture: Posture, angles: Float[np.ndarray, "K 2"]
) -> tuple[Station, Station]:
    """The stations and their slopes in their own two angles: a last axis of 2; status left 0."""
    given = posture, posture.x, posture.friction, angles
    return stations_at(*given), _by_station(_slopes, *given)


def met(posture: Posture, at: Station) -> dict[str, Bool[np.ndarray, "..."]]:
    """Which stations [...] meet each group of their constraints; `pose` asks for finite numbers,
    too."""
    shape = at.torque.shape
    rows = jax.tree.map(lambda leaf: leaf.reshape(-1, *leaf.shape[len(shape) :]), at)
    found = _in_sizes(_met, replace(posture, x=None, friction=None, criterion=None), rows)
    return {name: of.reshape(shape) for name, of in found.items()}


def _by_station(
    program: Callable[..., Station], posture: Posture, *given: Array | np.ndarray
) -> Station:
    """program(posture, x, friction, angles) of x, friction [...] and angles [..., 2]."""
    x, friction, angles = map(np.asarray, given)
    shape = np.broadcast_shapes(x.shape, friction.shape, angles.shape[:-1])
    each = [np.broadcast_to(of, shape).reshape(-1) for of in (x, friction)]
    pairs = np.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)
    none = dict.fromkeys(("x", "friction", "leg_rate", "criterion"))
    none |= dict.fromkeys(("min_normal", "min_grip", "min_clearance", "max_torque"))
    found = _in_sizes(program, replace(posture, **none), *each, pairs)
    return jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[1:]), found)


def _in_sizes(program: Callable[..., Result], shared: Posture, *rows: object) -> Result:
    """program(shared, *rows), rows being trees of arrays [n, ...], in float64."""
    count, most = len(jax.tree.leaves(rows)[0]), SIZES[-1]
    parts = []
    with jax.enable_x64(True):
        for begin in range(0, count, most):
            here = min(count - begin, most)
            size = next(size for size in SIZES if size >= here)
            part = jax.tree.map(lambda of, b=begin, s=size: padded(of[b : b + s], s), rows)
            found = program(shared, *part)
            parts.append(jax.tree.map(lambda leaf, n=here: np.asarray(leaf)[:n], found))
    if len(parts) == 1:
        return parts[0]
    return jax.tree.map(lambda *of: np.concatenate(of), *parts)


def padded(rows: np.ndarray, size: int) -> np.ndarray:
    """The last entry repeated up to that many."""
    more = np.broadcast_to(rows[-1], (size - len(rows), *rows.shape[1:]))
    return np.concatenate([rows, more]) if len(more) else rows


@jax.jit
def _stations(posture: Posture, x: Array, friction: Array, angles: Array) -> Station:
    return posture.stations_at(x, friction, angles)


@jax.jit
def _slopes(posture: Posture, x: Array, friction: Array, angles: Array) -> Station:
    def numbers_of(x: Float[Array, ""], friction: Float[Array, ""], pair: Float[Array, " 2"]):
        at = posture.stations_at(x, friction, pair)
        return at._replace(status=jnp.zeros_like(at.torque))

    return jax.vmap(jax.jacfwd(numbers_of, argnums=2))(x, friction, angles)


@jax.jit
def _met(posture: Posture, at: Station) -> dict[str, Array]:
    met = {name: (of >= 0).all(-1) for name, of in posture.margins(at).items()}
    return met | {"pose": met["pose"] & at.finite}
