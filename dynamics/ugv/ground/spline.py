"""Ground as piecewise polynomials: through given points, or a table of another profile."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from functools import reduce
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics import checks
from stickslip.dynamics.pytrees import Numeric, pytree_dataclass
from stickslip.dynamics.ugv.ground.shapes import Closed, as_floats, in_two, locate, require_ends

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.ugv.ground.shapes import Profile

INTERPOLATIONS = ("cubic", "pchip", "makima", "linear")

EVEN = 1e-6
"""Knots this close to even spacing, in pieces, are looked up by arithmetic."""

MOST_PIECES = 2**11
"""Most pieces of a spline whose bend is bounded in a kernel."""
SHORT, LEAST = 512, 64
"""Most pieces of ground that are never cut, and fewest that are cut out."""
POWERS = 6
"""Greatest order of a spline's polynomials."""
STEEPEST = 8.0
"""Slope at a spline's knots up to which MARGIN covers the jumps."""

BYTES_A_PIECE = 400
"""Memory for each piece of a table while it is made, about [bytes]."""


@pytree_dataclass
class Spline(Closed):
    """Polynomials by rising power of the distance from the knot at their left.

    Past the ends it goes on straight with the slope it has there. even: whether the knots are
    evenly spaced, and so found without a search; static. Knots are knots + rests and heights at
    them coefficients[:, 0] + lows [m], each in two parts (`in_two`), so that single precision keeps
    the digits of ground far from x = 0 and y = 0. Built from concrete numbers the arrays are
    NumPy's, in double precision whatever jax_enable_x64 says; the computation rounds them.
    """

    knots: Float[np.ndarray | Array, "pieces+1"]
    rests: Float[np.ndarray | Array, "pieces+1"]
    coefficients: Float[np.ndarray | Array, "pieces powers"]
    lows: Float[np.ndarray | Array, "pieces"]
    even: bool = field(metadata={"static": True})

    @classmethod
    def of(cls, knots: np.ndarray, coefficients: np.ndarray, even: bool) -> Spline:
        """The spline of concrete numbers in double precision."""
        heights, lows = in_two(coefficients[:, 0])
        table = np.concatenate([heights[:, None], coefficients[:, 1:]], axis=1)
        first, rests = in_two(knots)
        return cls(first, rests, table, lows, even=even)

    def _near(self, base, u, knots, rests, coefficients, lows):
        """The polynomial of the piece that base + u [m] lies in, by Horner's rule."""
        piece, t, outside = locate(knots, rests, self.even, base, u)
        row = coefficients[piece]
        powers = coefficients.shape[-1]
        y, dy, half = row[..., powers - 1], jnp.zeros_like(t), jnp.zeros_like(t)
        for k in range(powers - 2, -1, -1):
            lowest = row[..., k] if k else lows[piece]
            half, dy, y = half * t + dy, dy * t + y, y * t + lowest
        return (row[..., 0], y + dy * outside), dy, jnp.where(outside == 0, 2 * half, 0.0)

    def _greatest_bend(self, radius, knots, rests, rows, lows):
        """The largest Bernstein coefficient of each piece, which bounds its polynomial;
        infinite where heights or slopes jump at knots by more than rounding."""
        pieces, powers = rows.shape[-2:]
        if pieces > MOST_PIECES or powers > POWERS:
            return None
        h = (knots[..., 1:] - knots[..., :-1]) + (rests[..., 1:] - rests[..., :-1])
        zero = jnp.zeros_like(lows)
        # In parts of the piece: what each power adds to the height at its end.
        c0, *c = (rows[..., k] * h**k if k < powers else zero for k in range(POWERS))
        q = [(k + 1) * k * c[k] for k in range(1, POWERS - 1)]
        corners = [q[0], q[0] + q[1] / 3, q[0] + (2 * q[1] + q[2]) / 3, sum(q)]
        bend = jnp.maximum(jnp.max(reduce(jnp.maximum, corners) / h**2, axis=-1), 0)
        slope = rows[..., 1]
        turn = slope[..., 1:] - (sum((k + 1) * c[k] for k in range(POWERS - 1)) / h)[..., :-1]
        rise = (c0[..., 1:] - c0[..., :-1]) + (lows[..., 1:] - (lows + sum(c))[..., :-1])
        knots_below = 1 + 2 * radius / jnp.min(h, axis=-1)
        eps = jnp.finfo(h.dtype).eps
        turn, rise = (knots_below * jnp.max(of, axis=-1, initial=0) for of in (turn, rise))
        steep = jnp.max(jnp.abs(slope), axis=-1)
        smooth = (turn <= jnp.sqrt(eps) / 16) & (rise <= 64 * eps * radius) & (steep <= STEEPEST)
        return jnp.where(smooth, bend, jnp.inf)

    def cut(self, first: float, last: float) -> Spline:
        """The pieces from first to last [m], and so many more that their count is a power of four;
        itself where it is short. Of concrete numbers."""
        part = pieces_between(np.asarray(self.knots), first, last)
        if part is None:
            return self
        ends = slice(part.start, part.stop + 1)
        knots, rows = (self.knots[ends], self.rests[ends]), self.coefficients[part]
        return Spline(*knots, rows, self.lows[part], even=self.even)

    def require_resolved(self, dtype: Any) -> None:
        """Raise ValueError where knots coincide in `dtype`, or the polynomials overflow it."""
        if not checks.is_concrete(self.knots, self.rests, self.coefficients):
            return
        knots, rests = (np.asarray(v, np.float64) for v in (self.knots, self.rests))
        with np.errstate(over="ignore"):
            rows = np.asarray(self.coefficients).astype(dtype)
            narrow = (knots + rests).astype(dtype)
        if not np.all(np.isfinite(rows)):
            raise ValueError(
                f"the spline overflows {np.dtype(dtype).name}; accepted: points farther apart or "
                "nearer in height, or double precision (jax_enable_x64)"
            )
        same = np.flatnonzero(~(narrow[..., 1:] > narrow[..., :-1]))
        if same.size and knots.ndim == 1:
            i = int(same[0]) + 1
            raise ValueError(
                f"x[{i}] = {knots[i] + rests[i]} and x[{i - 1}] = {knots[i - 1] + rests[i - 1]} "
                f"are one number in {np.dtype(dtype).name}; accepted: points farther apart, x "
                "nearer 0, or double precision (jax_enable_x64)"
            )


def pieces_between(edges: Float[np.ndarray, "n+1"], first: float, last: float) -> slice | None:
    """Pieces of ground from first to last [m], a power of four of them, LEAST or more; None: all,
    where they are no more than SHORT. Evaluating few pieces is faster, and equal counts share
    programs: a part that reaches beyond an end is moved, not shortened."""
    pieces = len(edges) - 1
    if edges.ndim != 1 or pieces <= SHORT:
        return None
    beyond = max(edges[0] - first, 0.0) - max(last - edges[-1], 0.0)
    begin, end = np.searchsorted(edges, [first + beyond, last + beyond], side="right").tolist()
    begin = max(begin - 2, 0)
    count = LEAST
    while count < end + 1 - begin:
        count *= 4
    if count >= pieces:
        return None
    begin = min(begin, pieces - count)
    return slice(begin, begin + count)


def spline_through(x: Numeric, y: Numeric, interpolation: str = "cubic") -> Spline:
    """A spline through concrete points; see Track.from_points. SciPy computes it, in float64."""
    checks.require_choice("interpolation", interpolation, INTERPOLATIONS)
    x, y = _checked_points(x, y)
    coefficients = _coefficients(x, y, interpolation)
    bad = np.flatnonzero(~np.all(np.isfinite(coefficients), axis=1))
    if bad.size:
        i = int(bad[0])
        raise ValueError(
            f"the spline from x[{i}] = {x[i]} to x[{i + 1}] = {x[i + 1]} overflows float64; "
            "accepted: points farther apart or nearer in height, and no more than 1e100 m of both"
        )
    spacing = (x[-1] - x[0]) / (x.size - 1)
    even = np.all(np.abs(x - x[0] - spacing * np.arange(x.size)) <= EVEN * spacing)
    return Spline.of(x, coefficients, bool(even))


def hermite_table(
    profile: Callable[..., Profile], start: Numeric, end: Numeric, pieces: int
) -> Spline:
    """`pieces` equal quintics from start to end [m] that hold a profile's values at the knots.

    Height, slope and second derivative are the profile's at every knot, so the table is twice
    continuously differentiable between its ends. For pieces of length h the height is off by
    h^6 |y^(6)| / 46080 at most. Pure in JAX: start, end and the profile's numbers may be traced;
    the table then has their precision, and in single precision the second derivative also carries
    rounding, about 1e-6 |y| / h^2. Of a track's or a shape's own method with concrete numbers it is
    computed in double precision.
    """
    pieces = checks.require_integer("pieces", pieces)
    given = f"pieces = {checks.shown(pieces)}"
    checks.require_memory(given, "pieces of a table", pieces, BYTES_A_PIECE)
    require_ends(start, end)
    owner = getattr(profile, "__self__", None)
    if owner is None or not checks.is_concrete(owner, start, end):
        first, last = as_floats(start, end)
        knots, rows = _table(profile, first, last, pieces)
        return Spline(knots, jnp.zeros_like(knots), rows, jnp.zeros_like(rows[:, 0]), even=True)
    with jax.enable_x64(True), eval_context():
        first, last = (jnp.asarray(np.asarray(at, np.float64)) for at in (start, end))
        knots, rows = (np.asarray(of, np.float64) for of in _table(profile, first, last, pieces))
    return Spline.of(knots, rows, even=True)


def _table(
    profile: Callable[[jax.Array], Profile], first: jax.Array, last: jax.Array, count: int
) -> tuple[jax.Array, jax.Array]:
    """Knots and coefficients [count, 6]; each piece as long as its knots say."""
    knots = first + (last - first) / count * jnp.arange(count + 1, dtype=first.dtype)
    y, dy, d2y = profile(knots)
    knots = knots.astype(y.dtype)
    h = knots[1:] - knots[:-1]
    rise = y[1:] - y[:-1] - h * (dy[:-1] + h / 2 * d2y[:-1])
    turn = h * (dy[1:] - dy[:-1] - h * d2y[:-1])
    bend = h * h * (d2y[1:] - d2y[:-1])
    upper = [10 * rise - 4 * turn + bend / 2, 7 * turn - 15 * rise - bend]
    upper.append(6 * rise - 3 * turn + bend / 2)
    lower = [y[:-1], dy[:-1], d2y[:-1] / 2]
    scaled = [power / h**k for k, power in zip((3, 4, 5), upper, strict=True)]
    return knots, jnp.stack([*lower, *scaled], axis=-1)


def _coefficients(x: np.ndarray, y: np.ndarray, interpolation: str) -> np.ndarray:
    """[pieces, powers], by rising power."""
    from scipy import interpolate  # JAX depends on it; slow to import, and seldom needed

    with np.errstate(all="ignore"):  # what overflows is refused with its place, by the caller
        if interpolation == "linear":
            return np.stack([y[:-1], np.diff(y) / np.diff(x)], axis=1)
        try:
            if interpolation == "cubic":
                found = interpolate.CubicSpline(x, y, bc_type="natural")
            elif interpolation == "pchip":
                found = interpolate.PchipInterpolator(x, y)
            else:
                found = interpolate.Akima1DInterpolator(x, y, method="makima")
        except (ValueError, np.linalg.LinAlgError):  # of numbers that overflowed on the way
            return np.full((x.size - 1, 4), np.nan)
    return found.c[::-1].T


def _checked_points(x: Numeric, y: Numeric) -> tuple[np.ndarray, np.ndarray]:
    """x and y in float64, or ValueError naming the first point that will not do."""
    if not checks.is_concrete(x, y):
        raise ValueError(
            "the points are traced; accepted: concrete points (build the track outside the "
            "transformation and pass it in: its coefficients may be traced)"
        )
    arrays = []
    for name, values in (("x", x), ("y", y)):
        row = checks.as_real(name, values, "finite numbers [m], at least 2").astype(np.float64)
        if row.ndim != 1 or row.size < 2:
            raise ValueError(f"{name} has shape {row.shape}; accepted: one axis, at least 2 points")
        bad = np.flatnonzero(~np.isfinite(row))
        if bad.size:
            raise ValueError(f"{name}[{bad[0]}] = {row[bad[0]]}; accepted: finite numbers [m]")
        arrays.append(row)
    x, y = arrays
    if x.shape != y.shape:
        raise ValueError(f"x has {x.size} points and y {y.size}; accepted: as many y as x")
    checks.require_increasing("x", x, "strictly increasing x [m]")
    return x, y
