"""The ground that the UGV drives over: a profile y = f(x), its ends, and its arc length S(x)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import InitVar, field, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics.checks import (
    is_concrete,
    require_choice,
    require_integer,
    require_kind,
    require_known,
    require_memory,
    shown,
)
from stickslip.dynamics.names import TRACKS
from stickslip.dynamics.pytrees import (
    Number,
    Numbers,
    Numeric,
    float_type,
    holds_numbers,
    pytree_dataclass,
    rebuilt,
    require_one,
    run_once,
    same_rank,
    settle,
)
from stickslip.dynamics.ugv.ground import shapes, spline
from stickslip.dynamics.ugv.ground.roughness import class_roughness, rough_table
from stickslip.dynamics.ugv.ground.surface import Surface

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.ugv.ground.shapes import Profile


def _constructor(kind: type[Any]) -> Callable[..., Track]:
    """`Track.bump` and the like: the shape's numbers, and start and end [m]."""

    def make(*numbers: Number, start: Number = 0.0, end: Number = 8.0, **named: Number) -> Track:
        require_known(named, [one.name for one in fields(kind)], f"argument of {kind.__name__}")
        return _placed(kind(*numbers, **named), start, end)

    make.__doc__ = kind.__doc__
    return staticmethod(make)


@pytree_dataclass
class Track:
    """A ground profile, x forwards and y up [m].

    shape: the profile; its kind is static under jit, its numbers are not. start, end: where a
    drive along it begins and ends by default [m]. The ground goes on beyond them: the closed forms
    and functions are defined everywhere; splines and tables (from_points, rough, resampled) go on
    straight past their last knots with the slope there, which leaves the natural spline twice
    continuously differentiable and the others once. surface: how well the ground grips, place by
    place, as a factor on the friction coefficient; None: the same everywhere.
    """

    shape: shapes.Shape
    start: Numeric
    end: Numeric
    surface: Surface | None = None

    @partial(jax.jit, inline=True)
    def profile(self, x: Real[Number, "..."]) -> Profile:
        """Height f [m], slope f' [-] and second derivative f'' [1/m] at each x [m], any shape."""
        return self.shape.profile(x)

    def height(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """f(x) [m]."""
        return self.profile(x)[0]

    def slope(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """f'(x) [-], the tangent of the ground's angle."""
        return self.profile(x)[1]

    def seen_from(self, x: Real[Number, "..."]) -> shapes.Near:
        """The ground with distances and heights counted from its points at x [...] [m]."""
        return shapes.seen_from(self.shape, *shapes.as_floats(x))

    def require_resolved(self, dtype: Any) -> None:
        """Raise ValueError where points of the ground are one number in `dtype`."""
        if isinstance(self.shape, spline.Spline):
            self.shape.require_resolved(dtype)

    @classmethod
    def from_function(
        cls, function: Callable[[Array], Array], start: Number = 0.0, end: Number = 10.0
    ) -> Track:
        """y = function(x): one number to one number, in jax.numpy, twice differentiable.

        The function is kept, static and hashable; its derivatives are JAX's. Five points from start
        to end are tried: ValueError where it fails or is not finite.
        """
        track = _placed(shapes.Function(function), start, end)
        if is_concrete(start, end):
            first, last = (float(np.ravel(np.asarray(v))[0]) for v in (start, end))
            shapes.require_function(function, np.linspace(first, last, 5))
        return track

    @classmethod
    def from_points(cls, x: Numbers, y: Numbers, interpolation: str = "cubic") -> Track:
        """A curve through concrete points, x strictly increasing [m], two or more.

        interpolation: "cubic", the natural spline, twice continuously differentiable; "pchip" and
        "makima", once, without or with little overshoot; "linear", with kinks, at which the slope
        is that of the piece on the right. Points of even spacing are looked up by arithmetic,
        others by bisection. ValueError for points that will not do.
        """
        shape = spline.spline_through(x, y, interpolation)
        return cls(shape, float(np.asarray(x, float)[0]), float(np.asarray(x, float)[-1]))

    @classmethod
    def named(cls, name: str, **numbers) -> Track:
        """One of TRACKS by its name, with its constructor's arguments."""
        require_choice("name", name, TRACKS)
        return getattr(cls, name)(**numbers)

    flat = _constructor(shapes.Flat)
    incline = _constructor(shapes.Incline)
    bump = _constructor(shapes.Bump)
    sinusoid = _constructor(shapes.Sinusoid)
    ramp = _constructor(shapes.Ramp)
    step = _constructor(shapes.Step)
    ditch = _constructor(shapes.Ditch)

    @classmethod
    def rough(
        cls,
        key: int | Array = 0,
        iso_class: str = "C",
        *,
        start: Number = 0.0,
        end: Number = 20.0,
        margin: Number = 2.0,
    ) -> Track:
        """Random ground of an ISO 8608 class, "A" (very good road) to "H".

        key: a JAX key, or a seed. margin: how far the ground goes on beyond start and end [m]
        before it is straight. Start, end and margin are known before tracing.
        """
        if isinstance(key, int | np.integer | bool):
            key = jax.random.key(require_integer("key", key, low=-(2**31), high=2**31 - 1))
        level = class_roughness(iso_class)
        margin = require_one("margin", margin, low=0.0, accepted="a finite length >= 0 [m]")
        ends = ("start", start), ("end", end)
        first, last = (require_one(name, at, accepted="a finite position [m]") for name, at in ends)
        shapes.require_ends(first, last)
        return _placed(rough_table(key, level, first - margin, last + margin), start, end)

    def resampled(self, start: Number, end: Number, pieces: int) -> Track:
        """The same ground from start to end [m] as a table of quintics: one price for any shape.

        How exact it is: hermite_table. Past the ends it goes on straight, so enclose the drive and
        the vehicle's length. The track's own start and end are kept.
        """
        return replace(self, shape=spline.hermite_table(self.profile, start, end, pieces))

    def astype(self, dtype: DTypeLike) -> Track:
        """The same track with every number as an array of `dtype`.

        ValueError where points are one number in it.
        """
        self.require_resolved(dtype)
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), self)


def track_of(track: Any) -> Track:
    """The track itself, or the one of that name; ValueError for anything else."""
    if isinstance(track, str):
        require_choice("track", track, TRACKS, also="a Track")
        return Track.named(track)
    require_kind("track", track, Track, f"a Track, or {', '.join(map(repr, TRACKS))}")
    return track


def _placed(shape: shapes.Shape, start: Number, end: Number) -> Track:
    """A track whose numbers have been checked: they are kept as they are given."""
    if not isinstance(shape, shapes.Function):
        shapes.require_numbers(shape)
    shapes.require_ends(start, end)
    return Track(shape, start, end)


NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)
"""The Gauss-Legendre rule in -1 ... 1: exact for polynomials of degree 9."""
CELLS = 256
"""Number of cells between traced ends."""
LONGEST_CELL = 1 / 16
"""Longest cell on concrete ground [m]; without knots there are CELLS, 2 CELLS, 4 CELLS ..., so that
compiled programs are shared."""

BYTES_A_CELL = 200
"""While it is made, about."""


@pytree_dataclass
class Odometer:
    """Arc length S(x) = integral of sqrt(1 + f'^2) from the start [m].

    What is integrated is sqrt(1 + f'^2) - 1, to which x - start is added: single precision keeps
    its digits. edges + rests: of the cells [m], in two parts as a Spline's knots; even: whether
    they are evenly spaced, static. excess: that integral from the start to each edge. Build it with
    `along`; `dataclasses.replace` of track, start or end integrates anew.
    """

    track: Track
    start: Numeric
    end: Numeric
    cells: InitVar[int | None] = None
    edges: Float[np.ndarray | Array, "cells+1"] = field(init=False, repr=False)
    rests: Float[np.ndarray | Array, "cells+1"] = field(init=False, repr=False)
    excess: Float[np.ndarray | Array, "cells+1"] = field(init=False, repr=False)
    even: bool = field(init=False, repr=False, metadata={"static": True})

    def __post_init__(self, cells: int | None):
        if holds_numbers(self.track, self.start, self.end):
            _integrate(self, cells)
        else:
            settle(self, edges=None, rests=None, excess=None, even=True)

    @classmethod
    def along(
        cls,
        track: Track | str,
        start: Numeric | None = None,
        end: Numeric | None = None,
        cells: int | None = None,
    ) -> Odometer:
        """Integrate once from start to end [m], by default the track's; cells: static.

        cells: how many of even length; None: on concrete ground no longer than LONGEST_CELL, and
        between the knots of a spline, so that none hides inside one, else CELLS. On concrete ground
        all is computed in double precision, whatever jax_enable_x64 says.

        Between the ends S is exact to rounding where the ground is smooth within a cell, and good
        to about 1e-12 m where knots of a smooth spline lie inside cells. Beyond them one rule spans
        the whole distance from the end: exact where the track is straight, off by 1e-10 m at 0.5 m
        and 4e-7 m at 1 m from the end on the default sinusoid. So enclose what is asked often.
        """
        track = track_of(track)
        if cells is not None:
            require_integer("cells", cells)
            require_memory(f"cells = {shown(cells)}", "cells of an odometer", cells, BYTES_A_CELL)
        start = track.start if start is None else start
        end = track.end if end is None else end
        shapes.require_ends(start, end)
        return cls(track, start, end, cells)

    def between(self, first: float, last: float) -> Odometer:
        """The same over a part of long ground through points, from first to last [m], faster to
        evaluate; itself of other ground. Arc lengths are still counted from the start."""
        shape = self.track.shape
        if not isinstance(shape, spline.Spline):
            return self
        part = spline.pieces_between(np.asarray(self.edges), first, last)
        ends = slice(None) if part is None else slice(part.start, part.stop + 1)
        cells = {name: getattr(self, name)[ends] for name in ("edges", "rests", "excess")}
        return rebuilt(self, track=replace(self.track, shape=shape.cut(first, last)), **cells)

    @partial(jax.jit, inline=True)
    def distance(self, x: Float[Array, "..."]) -> Float[Array, "..."]:
        """S(x) [m] at each x [m], any shape; negative before the start. dS/dx = sqrt(1 + f'^2)."""
        x, start = shapes.as_floats(x, self.start)
        return (x - start) + self.excess_at(x, jnp.zeros_like(x))

    def excess_at(self, base: Float[Array, "..."], u: Float[Array, "..."]) -> Float[Array, "..."]:
        """S(x) - (x - start) [m] at x = base + u, a sum that is not rounded; see parts_of."""
        base, u, *_ = shapes.as_floats(base, u, self.excess)
        return _excess_at(self, *jnp.broadcast_arrays(base, u))


def _integrate(odometer: Odometer, cells: int | None) -> None:
    """Fill in the cells; those of concrete ground in double precision."""
    track, start, end = odometer.track, odometer.start, odometer.end
    if not is_concrete(track, start, end) or np.ndim(start) or np.ndim(end):
        dtype, count = float_type((track, start, end), 0.0), CELLS if cells is None else cells
        track, start, end = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), (track, start, end))
        edges = start + (end - start) / count * jnp.arange(count + 1, dtype=dtype)
        excess = jnp.concatenate([jnp.zeros(1, dtype), jnp.cumsum(_pieces(track, edges))])
        settle(odometer, track=track, start=start, end=end, even=True)
        settle(odometer, edges=edges, rests=jnp.zeros_like(edges), excess=excess)
        return
    start, end = float(start), float(end)
    edges, even = _edges(track, start, end, cells)
    first, rests = shapes.in_two(edges)
    wide = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), track)
    with jax.enable_x64(True), eval_context():
        sums = np.append(0.0, np.cumsum(np.asarray(_integrals(wide, jnp.asarray(edges)))))
        settle(odometer, track=wide, start=start, end=end)
        settle(odometer, edges=first, rests=rests, excess=sums, even=even)
        before = 0.0 if start == edges[0] else np.asarray(_excess_once(odometer, start))
    settle(odometer, track=track, excess=sums - before)


def _edges(track: Track, start: float, end: float, cells: int | None) -> tuple[np.ndarray, bool]:
    """The cells' edges in double precision, and whether they are even."""
    shape = track.shape
    if cells is not None or not isinstance(shape, spline.Spline) or np.ndim(shape.knots) != 1:
        most = max((end - start) / LONGEST_CELL, CELLS)
        count = CELLS * 2.0 ** np.ceil(np.log2(most / CELLS)) if cells is None else cells
        _require_room(end - start, count)
        return np.linspace(start, end, int(count) + 1), True
    # All of the spline, whose ends one rule goes past exactly, whatever start and end are.
    knots = np.asarray(shape.knots, np.float64) + np.asarray(shape.rests, np.float64)
    split = np.maximum(np.ceil(np.diff(knots) / LONGEST_CELL), 1.0)
    _require_room(knots[-1] - knots[0], np.sum(split))
    if shape.even:
        return np.linspace(knots[0], knots[-1], (len(knots) - 1) * int(np.max(split)) + 1), True
    split = split.astype(int)
    part = np.arange(np.sum(split)) - np.repeat(np.cumsum(split) - split, split)
    inner = np.repeat(knots[:-1], split) + part * np.repeat(np.diff(knots) / split, split)
    return np.append(inner, knots[-1]), False


def _require_room(length: float, count: float) -> None:
    require_memory(f"end - start = {length:.6g}", "cells of an odometer", count, BYTES_A_CELL)


def _by_rule(odometer: Odometer, base: jax.Array, u: jax.Array) -> jax.Array:
    """The stored integral at the edge to the left, and that of the rest of the cell."""
    edges, rests, excess = (
        jnp.asarray(v, base.dtype) for v in (odometer.edges, odometer.rests, odometer.excess)
    )
    cell, t, outside = shapes.locate(edges, rests, odometer.even, base, u)
    length = t + outside
    past = outside > 0
    # Past the end the integral of the last cell is known, and the rule spans the way from there.
    here = excess[cell + past.astype(cell.dtype)]
    length = jnp.where(past, outside, length)
    return here + _excess_over(odometer.track, base, u - length, length)


_excess_at = jax.custom_jvp(_by_rule)


@_excess_at.defjvp
def _excess_jvp(primals, tangents):
    """Derivative in x: the integrand itself rather than a derivative of the rule."""
    odometer, base, u = primals
    odometer_dot, base_dot, u_dot = tangents
    value, by_numbers = jax.jvp(lambda o: _by_rule(o, base, u), (odometer,), (odometer_dot,))
    slope = shapes.parts_of(odometer.track.shape, base, u)[1]
    return value, by_numbers + (base_dot + u_dot) * _excess(slope)


def _excess(slope: jax.Array) -> jax.Array:
    """sqrt(1 + slope^2) - 1, without cancellation."""
    square = slope * slope
    return square / (1 + jnp.sqrt(1 + square))


def _excess_over(track: Track, base: jax.Array, left: jax.Array, length: jax.Array) -> jax.Array:
    """Integral of sqrt(1 + f'^2) - 1 from each base + left over each `length`, by one rule."""
    nodes, weights = (jnp.asarray(v, length.dtype) for v in (NODES, WEIGHTS))
    nodes, weights, first, width = same_rank(nodes, weights, left[..., None], length[..., None])
    slope = shapes.parts_of(track.shape, base[..., None], first + width * (1 + nodes) / 2)[1]
    return length / 2 * jnp.sum(weights * _excess(slope), axis=-1)


def _pieces(track: Track, edges: jax.Array) -> jax.Array:
    """The integral over each cell."""
    left, length = edges[:-1], edges[1:] - edges[:-1]
    return _excess_over(track, left, jnp.zeros_like(left), length)


_integrals = run_once(_pieces)
_excess_once = run_once(lambda odometer, x: odometer.excess_at(x, jnp.zeros_like(x)))
