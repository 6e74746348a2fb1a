"""Ground as piecewise polynomials: through given points, or a table of another profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_choice
from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv.shapes import as_floats

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.ugv.shapes import Profile

INTERPOLATIONS = ("cubic", "pchip", "makima", "linear")

EVEN = 1e-6
"""Knots this close to even spacing, in pieces, are looked up by arithmetic."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Spline:
    """Polynomials by rising power of the distance from the knot at their left.

    Past the ends it goes on straight with the slope it has there. even: whether the knots are
    evenly spaced, and so found without a search; static.
    """

    knots: Float[Array, "pieces+1"]
    coefficients: Float[Array, "pieces powers"]
    even: bool = field(metadata={"static": True})

    def profile(self, x: Numeric) -> Profile:
        """The polynomial of the piece that x [m] lies in, by Horner's rule."""
        x, knots, coefficients = as_floats(x, self.knots, self.coefficients)
        first, last = knots[0], knots[-1]
        inside = jnp.where(x < first, first, jnp.where(x > last, last, x))
        piece = self._piece(inside, knots)
        t, row = inside - knots[piece], coefficients[piece]
        powers = coefficients.shape[-1]
        y, dy, half = row[..., powers - 1], jnp.zeros_like(x), jnp.zeros_like(x)
        for k in range(powers - 2, -1, -1):
            half, dy, y = half * t + dy, dy * t + y, y * t + row[..., k]
        return y + dy * (x - inside), dy, jnp.where(x == inside, 2 * half, 0.0)

    def _piece(self, x: jax.Array, knots: jax.Array) -> jax.Array:
        count = knots.shape[-1] - 1
        if self.even:
            place = jnp.floor((x - knots[0]) * (count / (knots[-1] - knots[0]))).astype(jnp.int32)
        else:
            place = jnp.searchsorted(knots, x, side="right").astype(jnp.int32) - 1
        return jnp.clip(place, 0, count - 1)


def spline_through(x: Numeric, y: Numeric, interpolation: str = "cubic") -> Spline:
    """A spline through concrete points; see Track.from_points. SciPy computes it, in float64."""
    require_choice("interpolation", interpolation, INTERPOLATIONS)
    x, y = _checked_points(x, y)
    coefficients = _coefficients(x, y, interpolation)
    dtype = jnp.zeros(()).dtype
    with np.errstate(over="ignore"):
        knots, rows = x.astype(dtype), coefficients.astype(dtype)
    same = np.flatnonzero(np.diff(knots) <= 0)
    if same.size:
        i = int(same[0]) + 1
        raise ValueError(
            f"x[{i}] = {x[i]} and x[{i - 1}] = {x[i - 1]} are one number in {dtype}; accepted: "
            "points farther apart, x nearer 0, or jax_enable_x64"
        )
    bad = np.flatnonzero(~np.all(np.isfinite(rows), axis=1))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"the spline from x[{i}] = {x[i]} to x[{i + 1}] = {x[i + 1]} overflows {dtype}; "
            "accepted: points farther apart or nearer in height"
        )
    count = x.size - 1
    spacing = (x[-1] - x[0]) / count
    even = np.all(np.abs(x - x[0] - spacing * np.arange(x.size)) <= EVEN * spacing)
    return Spline(jnp.asarray(knots), jnp.asarray(rows), bool(even))


def hermite_table(
    profile: Callable[..., Profile], start: Numeric, end: Numeric, pieces: int
) -> Spline:
    """`pieces` equal quintics from start to end [m] that hold a profile's values at the knots.

    Height, slope and second derivative are the profile's at every knot, so the table is twice
    continuously differentiable between its ends. For pieces of length h the height is off by
    h^6 |y^(6)| / 46080 at most. Pure in JAX: start, end and the profile's numbers may be traced.
    In single precision the second derivative also carries rounding, about 1e-6 |y| / h^2.
    """
    if isinstance(pieces, bool) or not isinstance(pieces, int | np.integer) or pieces < 1:
        raise ValueError(f"pieces = {pieces!r}; accepted: an integer >= 1")
    count = int(pieces)
    if is_concrete(start, end) and not np.all(np.asarray(start) < np.asarray(end)):
        raise ValueError(f"start = {start}, end = {end}; accepted: start < end [m]")
    first, last = as_floats(start, end)
    h = (last - first) / count
    knots = first + h * jnp.arange(count + 1, dtype=h.dtype)
    y, dy, d2y = profile(knots)
    knots, h = knots.astype(y.dtype), h.astype(y.dtype)
    rise = y[1:] - y[:-1] - h * (dy[:-1] + h / 2 * d2y[:-1])
    turn = h * (dy[1:] - dy[:-1] - h * d2y[:-1])
    bend = h * h * (d2y[1:] - d2y[:-1])
    upper = [10 * rise - 4 * turn + bend / 2, 7 * turn - 15 * rise - bend]
    upper.append(6 * rise - 3 * turn + bend / 2)
    lower = [y[:-1], dy[:-1], d2y[:-1] / 2]
    scaled = [power / h**k for k, power in zip((3, 4, 5), upper, strict=True)]
    return Spline(knots, jnp.stack([*lower, *scaled], axis=-1), even=True)


def _coefficients(x: np.ndarray, y: np.ndarray, interpolation: str) -> np.ndarray:
    """[pieces, powers], by rising power."""
    from scipy import interpolate  # JAX depends on it; slow to import, and seldom needed

    with np.errstate(all="ignore"):  # what overflows is refused with its place, by the caller
        if interpolation == "linear":
            return np.stack([y[:-1], np.diff(y) / np.diff(x)], axis=1)
        if interpolation == "cubic":
            found = interpolate.CubicSpline(x, y, bc_type="natural")
        elif interpolation == "pchip":
            found = interpolate.PchipInterpolator(x, y)
        else:
            found = interpolate.Akima1DInterpolator(x, y, method="makima")
    return found.c[::-1].T


def _checked_points(x: Numeric, y: Numeric) -> tuple[np.ndarray, np.ndarray]:
    """x and y in float64, or ValueError naming the first point that will not do."""
    if not is_concrete(x, y):
        raise ValueError(
            "the points are traced; accepted: concrete points (build the track outside the "
            "transformation and pass it in: its coefficients may be traced)"
        )
    arrays = []
    for name, values in (("x", x), ("y", y)):
        try:
            array = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise ValueError(f"{name} are no numbers: {error}; accepted: numbers [m]") from error
        if array.ndim != 1 or array.size < 2:
            raise ValueError(
                f"{name} has shape {array.shape}; accepted: one axis, at least 2 points"
            )
        bad = np.flatnonzero(~np.isfinite(array))
        if bad.size:
            raise ValueError(f"{name}[{bad[0]}] = {array[bad[0]]}; accepted: finite numbers [m]")
        arrays.append(array)
    x, y = arrays
    if x.shape != y.shape:
        raise ValueError(f"x has {x.size} points and y {y.size}; accepted: as many y as x")
    wrong = np.flatnonzero(np.diff(x) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        fault = "repeats" if x[i] == x[i - 1] else "is less than"
        raise ValueError(
            f"x[{i}] = {x[i]} {fault} x[{i - 1}] = {x[i - 1]}; accepted: strictly increasing x [m]"
        )
    return x, y
