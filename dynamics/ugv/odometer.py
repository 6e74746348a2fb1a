"""How far along the ground: the arc length that a rolling wheel lays off.

A wheel of radius r that rolls without slip and touches the ground at x, where its angle is
beta = atan f'(x), has turned by beta(x) - S(x) / r, anticlockwise positive, S being the arc length.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete
from stickslip.dynamics.numeric import Numeric, float_type
from stickslip.dynamics.ugv.shapes import as_floats
from stickslip.dynamics.ugv.track import Track

if TYPE_CHECKING:
    from jaxtyping import Array, Float

ORDER = 5
"""Points of the Gauss-Legendre rule in each cell: exact for polynomials of degree 9."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Odometer:
    """Arc length S(x) = integral of sqrt(1 + f'^2) from the start [m].

    What is integrated is sqrt(1 + f'^2) - 1, to which x - start is added: single precision keeps
    its digits. excess: that integral at the edges of the cells. Build it with `along`.
    """

    track: Track
    start: Numeric
    end: Numeric
    excess: Float[Array, "cells+1"]

    @classmethod
    def along(
        cls, track: Track, start: Numeric = None, end: Numeric = None, cells: int = 256
    ) -> Odometer:
        """Integrate once from start to end [m], by default the track's; cells: static.

        Between them S is exact to rounding where the ground is smooth within a cell, and good to
        about 1e-12 m where knots of a smooth spline lie inside cells. Beyond them one rule spans
        the whole distance from the end: exact where the track is straight, off by 1e-10 m at 0.5 m
        and 4e-7 m at 1 m from the end on the default sinusoid. So enclose what is asked often.
        """
        if isinstance(cells, bool) or not isinstance(cells, int) or cells < 1:
            raise ValueError(f"cells = {cells!r}; accepted: an integer >= 1")
        start = track.start if start is None else start
        end = track.end if end is None else end
        if is_concrete(start, end) and not np.all(np.asarray(start) < np.asarray(end)):
            raise ValueError(f"start = {start}, end = {end}; accepted: start < end [m]")
        dtype = float_type(track, start, end, 0.0)
        track, first, last = track.astype(dtype), *(jnp.asarray(v, dtype) for v in (start, end))
        width = (last - first) / cells
        edges = first + width * jnp.arange(cells, dtype=dtype)
        each = _excess_over(track, edges, jnp.broadcast_to(width, edges.shape))
        total = jnp.concatenate([jnp.zeros(1, dtype), jnp.cumsum(each)])
        return cls(track, first, last, total)

    def distance(self, x: Float[Array, "..."]) -> Float[Array, "..."]:
        """S(x) [m] at each x [m], any shape; negative before the start. dS/dx = sqrt(1 + f'^2)."""
        x, *_ = as_floats(x, self.start)
        return _distance(self, x)


def _by_rule(odometer: Odometer, x: jax.Array) -> jax.Array:
    """The stored integral at the edge to the left, the way from there, and the rest of the cell."""
    cells = odometer.excess.shape[-1] - 1
    width = (odometer.end - odometer.start) / cells
    cell = jnp.clip(jnp.floor((x - odometer.start) / width), 0, cells)
    left = odometer.start + cell * width
    rest = _excess_over(odometer.track, left, x - left)
    return (x - odometer.start) + (odometer.excess[cell.astype(jnp.int32)] + rest)


_distance = jax.custom_jvp(_by_rule)


@_distance.defjvp
def _distance_jvp(primals, tangents):
    """In x, the integrand itself rather than a derivative of the rule."""
    odometer, x = primals
    odometer_dot, x_dot = tangents
    distance, by_numbers = jax.jvp(lambda o: _by_rule(o, x), (odometer,), (odometer_dot,))
    return distance, by_numbers + x_dot * (1 + _excess(odometer.track.slope(x)))


def _excess(slope: jax.Array) -> jax.Array:
    """sqrt(1 + slope^2) - 1, without cancellation."""
    square = slope * slope
    return square / (1 + jnp.sqrt(1 + square))


def _excess_over(track: Track, left: jax.Array, length: jax.Array) -> jax.Array:
    """Integral of sqrt(1 + f'^2) - 1 from each `left` over each `length`, by one rule."""
    nodes, weights = (jnp.asarray(v, length.dtype) for v in np.polynomial.legendre.leggauss(ORDER))
    points = left[..., None] + length[..., None] * (1 + nodes) / 2
    return length / 2 * jnp.sum(weights * _excess(track.slope(points)), axis=-1)
