"""The ground that the UGV drives over: a profile y = f(x), and where a drive begins and ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import (
    is_concrete,
    require_choice,
    require_integer,
    require_kind,
    require_known,
    require_number,
    shown,
)
from stickslip.dynamics.names import TRACKS
from stickslip.dynamics.pytrees import Number, Numbers, Numeric, register_pytree, require_one
from stickslip.dynamics.ugv.ground.roughness import class_roughness, rough_table
from stickslip.dynamics.ugv.ground.shapes import (
    Bump,
    Ditch,
    Flat,
    Function,
    Incline,
    Near,
    Ramp,
    Shape,
    Sinusoid,
    Step,
    as_floats,
    require_ends,
    require_function,
    require_numbers,
    seen_from,
)
from stickslip.dynamics.ugv.ground.spline import Spline, hermite_table, spline_through

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.ugv.ground.shapes import Profile


@partial(jax.jit, inline=True)
def _profile(shape: Shape, x: Number) -> Profile:
    return shape.profile(x)


@register_pytree
@dataclass(frozen=True)
class Surface:
    """Friction coefficient along the ground, relative to the problem's.

    knots: places [n], ascending, two or more [m]. factors: there [n], >= 0 [-]; straight between
    the knots, constant beyond them. Patches are knots in pairs, as far apart as a wheel takes from
    one to the other. A factor is that of the point where a wheel touches. measured: the factors are
    mu itself, whatever the problem's friction; static.
    """

    knots: Real[Array | np.ndarray, "n"]
    factors: Real[Array | np.ndarray, "n"]
    measured: bool = field(default=False, metadata={"static": True})

    @classmethod
    def patches(cls, edges: Numbers, factors: Numbers, ramp: float = 0.05) -> Surface:
        """One factor [n + 1] on each side of the edges [n] [m], straight over a `ramp` about them.

        ValueError for edges that are not further apart than that.
        """
        require_number("edges", edges, accepted="places [m]")
        require_number("factors", factors, low=0.0, accepted="factors >= 0, one more than edges")
        require_number("ramp", ramp, low=0.0, strict=True, accepted="a length > 0 [m]")
        at, of = np.asarray(edges, float), np.asarray(factors, float)
        if (
            np.ndim(ramp)
            or at.ndim != 1
            or of.shape != (len(at) + 1,)
            or np.any(np.diff(at) <= ramp)
        ):
            raise ValueError(
                f"edges = {shown(edges)}, factors = {shown(factors)}, ramp = {shown(ramp)}; "
                "accepted: ascending edges further apart than one ramp [m], and one factor more"
            )
        return cls(*pairs(at, of, ramp)).validate()

    def validate(self) -> Surface:
        """Return self, or raise ValueError naming the field."""
        accepted = "ascending places, two or more [m]"
        require_number("knots", self.knots, accepted=accepted)
        require_number("factors", self.factors, low=0.0, accepted="finite factors >= 0")
        shape = np.shape(self.knots)
        if not shape or shape[-1] < 2 or np.shape(self.factors) != shape:
            raise ValueError(
                f"knots of shape {shape}, factors of shape {np.shape(self.factors)}; accepted: [n] "
                "of each, n >= 2"
            )
        if is_concrete(self.knots) and np.any(np.diff(np.asarray(self.knots, float)) <= 0):
            raise ValueError(f"knots = {shown(self.knots)}; accepted: {accepted}")
        return self

    def at(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """The factor at each x [m]."""
        x = jnp.asarray(x)
        knots, factors = (jnp.asarray(of, x.dtype) for of in (self.knots, self.factors))
        return jnp.interp(x, knots, factors)

    def mu(self, friction: Any, factors: Any) -> Any:
        """mu where `factors` of the surface are, on a problem with that friction [-]."""
        return factors if self.measured else friction * factors

    def most(self, first: Float[np.ndarray, "n"], last: Float[np.ndarray, "n"]) -> np.ndarray:
        """The greatest factor from each first to each last place [n] [m]; of concrete numbers."""
        knots, factors = np.asarray(self.knots, float), np.asarray(self.factors, float)
        ends = np.maximum(np.interp(first, knots, factors), np.interp(last, knots, factors))
        within = (knots > first[:, None]) & (knots < last[:, None])
        return np.maximum(ends, np.max(np.where(within, factors, 0.0), axis=-1))


def pairs(
    edges: Float[Array | np.ndarray, "n"],
    factors: Float[Array | np.ndarray, "m"],
    ramp: Number,
) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Knots and factors [2 n] of patches: two knots about each edge."""
    knots = jnp.stack([edges - ramp / 2, edges + ramp / 2], -1)
    return knots.reshape(-1), jnp.stack([factors[:-1], factors[1:]], -1).reshape(-1)


def _constructor(kind: type[Any]) -> Callable[..., Track]:
    """`Track.bump` and the like: the shape's numbers, and start and end [m]."""

    def make(*numbers: Number, start: Number = 0.0, end: Number = 8.0, **named: Number) -> Track:
        require_known(named, [one.name for one in fields(kind)], f"argument of {kind.__name__}")
        return _placed(kind(*numbers, **named), start, end)

    make.__doc__ = kind.__doc__
    return staticmethod(make)


@register_pytree
@dataclass(frozen=True)
class Track:
    """A ground profile, x forwards and y up [m].

    shape: the profile; its kind is static under jit, its numbers are not. start, end: where a
    drive along it begins and ends by default [m]. The ground goes on beyond them: the closed forms
    and functions are defined everywhere; splines and tables (from_points, rough, resampled) go on
    straight past their last knots with the slope there, which leaves the natural spline twice
    continuously differentiable and the others once. surface: how well the ground grips, place by
    place, as a factor on the friction coefficient; None: the same everywhere.
    """

    shape: Shape
    start: Numeric
    end: Numeric
    surface: Surface | None = None

    def profile(self, x: Real[Number, "..."]) -> Profile:
        """Height f [m], slope f' [-] and second derivative f'' [1/m] at each x [m], any shape."""
        return _profile(self.shape, x)

    def height(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """f(x) [m]."""
        return self.profile(x)[0]

    def slope(self, x: Real[Number, "..."]) -> Float[Array, "..."]:
        """f'(x) [-], the tangent of the ground's angle."""
        return self.profile(x)[1]

    def seen_from(self, x: Real[Number, "..."]) -> Near:
        """The ground with distances and heights counted from its points at x [...] [m]."""
        return seen_from(self.shape, *as_floats(x))

    def require_resolved(self, dtype: Any) -> None:
        """Raise ValueError where points of the ground are one number in `dtype`."""
        if isinstance(self.shape, Spline):
            self.shape.require_resolved(dtype)

    @classmethod
    def from_function(
        cls, function: Callable[[Array], Array], start: Number = 0.0, end: Number = 10.0
    ) -> Track:
        """y = function(x): one number to one number, in jax.numpy, twice differentiable.

        The function is kept as it is, static and hashable; slope and second derivative come from
        differentiating it. Five points from start to end are tried: ValueError where it fails
        or is not finite.
        """
        track = _placed(Function(function), start, end)
        if is_concrete(start, end):
            first, last = (float(np.ravel(np.asarray(v))[0]) for v in (start, end))
            require_function(function, np.linspace(first, last, 5))
        return track

    @classmethod
    def from_points(cls, x: Numbers, y: Numbers, interpolation: str = "cubic") -> Track:
        """A curve through concrete points, x strictly increasing [m], two or more.

        interpolation: "cubic", the natural spline, twice continuously differentiable; "pchip" and
        "makima", once, without or with little overshoot; "linear", with kinks, at which the slope
        is that of the piece on the right. Points of even spacing are looked up by arithmetic,
        others by bisection. ValueError for points that will not do.
        """
        shape = spline_through(x, y, interpolation)
        return cls(shape, float(np.asarray(x, float)[0]), float(np.asarray(x, float)[-1]))

    @classmethod
    def named(cls, name: str, **numbers) -> Track:
        """One of TRACKS by its name, with its constructor's arguments."""
        require_choice("name", name, TRACKS)
        return getattr(cls, name)(**numbers)

    flat = _constructor(Flat)
    incline = _constructor(Incline)
    bump = _constructor(Bump)
    sinusoid = _constructor(Sinusoid)
    ramp = _constructor(Ramp)
    step = _constructor(Step)
    ditch = _constructor(Ditch)

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
        first, last = (
            require_one(name, at, accepted="a finite position [m]")
            for name, at in (("start", start), ("end", end))
        )
        require_ends(first, last)
        return _placed(rough_table(key, level, first - margin, last + margin), start, end)

    def resampled(self, start: Number, end: Number, pieces: int) -> Track:
        """The same ground from start to end [m] as a table of quintics: one price for any shape.

        How exact it is: hermite_table. Past the ends it goes on straight, so enclose the drive and
        the vehicle's length. The track's own start and end are kept.
        """
        return replace(self, shape=hermite_table(self.profile, start, end, pieces))

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


def _placed(shape: Shape, start: Number, end: Number) -> Track:
    """A track whose numbers have been checked: they are kept as they are given."""
    if not isinstance(shape, Function):
        require_numbers(shape)
    require_ends(start, end)
    return Track(shape, start, end)
