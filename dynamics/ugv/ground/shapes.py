"""Ground profiles in closed form, and any function of the user's.

A shape is a frozen pytree with a method `profile(x) -> (height, slope, second derivative)`. Its
class is tree structure, hence static under jit; its fields are numbers and may be traced, batched
and differentiated. All of them are defined for every x. A shape with a method `near(base, u)` gives
the same at base + u without rounding that sum.

All about a vehicle follows from differences of x and of height over a metre or two. Taken from
places near by (`Near`), they keep their digits however far from x = 0 and y = 0 the ground lies;
taken from world coordinates they lose what those round off, in single precision 6e-5 m at 1000 m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field, fields
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_number, shown
from stickslip.dynamics.pytrees import Numeric, float_type, pytree_dataclass

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    Values = Float[Array, "..."]
    """A number for each member of a batch."""
    Points = Float[Array, "... 2"]
    """A point, or a vector, for each."""
    Profile = tuple[Values, Values, Values]


class Shape(Protocol):
    """Protocol of a track's shape."""

    def profile(self, x: Numeric) -> Profile:
        """Height [m], slope [-] and second derivative [1/m] at each x [m]."""
        ...


def as_floats(*values: Numeric) -> list[jax.Array]:
    """The values as arrays of their one floating type; integers and Python numbers adapt."""
    dtype = float_type(values, 0.0)
    return [jnp.asarray(value, dtype) for value in values]


MARGIN = 1 / 16
"""Relative margin of `nowhere_hollow`, for rounding and for jumps of a spline's slope by it."""
BUMP = 4 * np.exp(-1.5)
"""Greatest second derivative of exp(-z^2), beside the foot; at the top it is -2."""
RISE = 10 / np.sqrt(3)
"""Greatest second derivative of the quintic rise from 0 to 1 over a length of 1."""


def nowhere_hollow(shape: Any, radius: Values | float) -> Bool[Array, "..."] | None:
    """True if a wheel of this radius [m] is proved to touch the ground at one point, wherever it
    stands; None where nothing is known of the shape.

    Along the ground the sine of the slope angle changes by at most f'' for each metre of x, along
    the lower half of a circle of radius r by 1 / r. Where f'' < 1 / r everywhere, the ground
    therefore stays below a wheel that touches it, and nothing has to be looked up under the wheel.
    What is no such ground may still carry the wheel: then one has to look.
    """
    bend = shape.greatest_bend(radius) if isinstance(shape, Closed) else None
    if bend is None:
        return None
    bend, radius = as_floats(bend, radius)
    return radius * bend <= 1 - MARGIN


class Closed:
    """A shape in closed form: a dataclass of numbers, and `_near` of them."""

    def near(self, base: Numeric, u: Numeric) -> tuple[tuple, Any, Any]:
        """Parts of the height, slope and second derivative at base + u [m]; see `parts_of`."""
        return self._near(*as_floats(base, u, *_numbers_of(self).values()))

    def greatest_bend(self, radius: Values | float) -> Values | None:
        """A number that the second derivative exceeds nowhere [1/m]; infinite or None: not known.
        radius: of the wheel [m]."""
        return self._greatest_bend(*as_floats(radius, *_numbers_of(self).values()))

    def profile(self, x: Numeric) -> Profile:
        """Height [m], slope [-] and second derivative [1/m] at each x [m]."""
        (x,) = as_floats(x)
        parts, slope, second = self.near(x, jnp.zeros_like(x))
        return sum(parts), slope, second  # pyright: ignore[reportReturnType]

    def _near(self, *numbers: Any, **named: Any) -> Any:
        """`near` of base, u and the fields, all in one floating type."""
        raise NotImplementedError

    def _greatest_bend(self, radius: Any, *numbers: Any, **named: Any) -> Any:
        """`greatest_bend` of the radius and the fields, all in one floating type."""


def require_ends(start: Numeric, end: Numeric) -> None:
    """Raise ValueError unless both are finite positions [m] and start < end."""
    for name, value in (("start", start), ("end", end)):
        require_number(name, value, accepted="a finite position [m]")
    if is_concrete(start, end) and not np.all(np.asarray(start) < np.asarray(end)):
        raise ValueError(f"start = {shown(start)}, end = {shown(end)}; accepted: start < end [m]")


def _numbers_of(shape: Any) -> dict[str, Numeric]:
    """The fields that are numbers."""
    names = (one.name for one in fields(shape) if not one.metadata.get("static"))
    return {name: getattr(shape, name) for name in names}


def require_numbers(shape: Shape) -> None:
    """Raise ValueError unless every field is finite, and > 0 where the class says so."""
    length: dict[str, Any] = {"low": 0.0, "strict": True, "accepted": "a finite length > 0 [m]"}
    number: dict[str, Any] = {"accepted": "a finite number"}
    positive = getattr(shape, "POSITIVE", ())
    for name, value in _numbers_of(shape).items():
        if isinstance(value, list | tuple | dict):
            raise ValueError(f"{name} = {shown(value)}; accepted: a number, or an array of them")
        require_number(name, value, **(length if name in positive else number))


@pytree_dataclass
class Flat(Closed):
    """Level ground, y = 0."""

    def _near(self, base, u):
        zero = jnp.zeros_like(base + u)
        return (zero,), zero, zero

    def _greatest_bend(self, radius):
        return jnp.zeros_like(radius)


@pytree_dataclass
class Incline(Closed):
    """One endless straight through the origin, y = slope x. slope = tan(angle) [-]."""

    slope: Numeric = 0.3

    def _near(self, base, u, m):
        zero = jnp.zeros_like(base + u)
        return (m * base, m * u), m + zero, m * zero

    def _greatest_bend(self, radius, m):
        return jnp.zeros_like(m)


@pytree_dataclass
class Bump(Closed):
    """The chapter's soft bump, y = height exp(-((x - centre) / width)^2); all in [m]."""

    height: Numeric = 0.1
    centre: Numeric = 4.0
    width: Numeric = 1.0

    POSITIVE: ClassVar = ("width",)

    def _near(self, base, u, h, c, w):
        """With z = (x - centre) / width: y, -2 z y / width, (4 z^2 - 2) y / width^2."""
        z = ((base - c) + u) / w
        y = h * jnp.exp(-z * z)
        return (y,), -2 * z * y / w, (4 * z * z - 2) * y / (w * w)

    def _greatest_bend(self, radius, h, c, w):
        return jnp.where(h > 0, BUMP * h, -2 * h) / w**2


@pytree_dataclass
class Sinusoid(Closed):
    """y = amplitude sin(2 pi x / wavelength), without end; both in [m]."""

    amplitude: Numeric = 0.05
    wavelength: Numeric = 2.0

    POSITIVE: ClassVar = ("wavelength",)

    def _near(self, base, u, a, wavelength):
        """y, amplitude k cos(k x), -k^2 y with k = 2 pi / wavelength; whole waves left out of x."""
        k = 2 * np.pi / wavelength
        angle = k * (jax.lax.rem(*jnp.broadcast_arrays(base, wavelength)) + u)
        y = a * jnp.sin(angle)
        return (y,), a * k * jnp.cos(angle), -k * k * y

    def _greatest_bend(self, radius, a, wavelength):
        return jnp.abs(a) * (2 * np.pi / wavelength) ** 2


@pytree_dataclass
class Ramp(Closed):
    """A straight of one slope between two levels, y = 0 before it.

    slope: of the straight [-]; position: middle of the lower joint [m]; length: from there to the
    middle of the upper joint [m], so the rise is slope length; joint: length [m] over which the
    slope changes, as 3 u^2 - 2 u^3: twice continuously differentiable, level and straight exactly
    outside the joints. Joints longer than `length` overlap, and the slope stays below `slope`.
    """

    slope: Numeric = 0.3
    position: Numeric = 2.0
    length: Numeric = 4.0
    joint: Numeric = 1.0

    POSITIVE: ClassVar = ("length", "joint")

    def _near(self, base, u, m, begin, length, joint):
        """Rise of the slope at one joint, less that at the other, integrated in closed form."""
        z = (base - begin) + u
        up, down = (_bend(at, joint) for at in (z, z - length))
        y, dy, d2y = (m * (a - b) for a, b in zip(up, down, strict=True))
        return (y,), dy, d2y

    def _greatest_bend(self, radius, m, begin, length, joint):
        return 1.5 * jnp.abs(m) / joint


@pytree_dataclass
class Step(Closed):
    """A smoothed step from y = 0 up to y = height [m].

    position: its middle [m]; length: that of the rise [m]. The rise is the quintic
    10 u^3 - 15 u^4 + 6 u^5: twice continuously differentiable as the wheel's offset curve wants
    it, and exactly level outside. Steepest 1.875 height / length; the second derivative reaches
    5.77 height / length^2, which hollows the foot of the step more than a wheel of radius r can
    follow where that exceeds about 1 / r. By default the foot's least radius is 0.45 m.
    """

    height: Numeric = 0.1
    position: Numeric = 4.0
    length: Numeric = 0.5

    POSITIVE: ClassVar = ("length",)

    def _near(self, base, u, h, at, length):
        y, dy, d2y = _quintic_rise((base - at) + u, length)
        return (h * y,), h * dy, h * d2y

    def _greatest_bend(self, radius, h, at, length):
        return RISE * jnp.abs(h) / length**2


@pytree_dataclass
class Ditch(Closed):
    """A smoothed ditch (a flat-topped hump for depth < 0) in level ground, y = 0 outside.

    depth [m]; position: its middle [m]; width: between the middles of its sides [m]; side: length
    of each side [m], a quintic as in Step. Sides longer than `width` overlap, and the ditch stays
    shallower than `depth`.
    """

    depth: Numeric = 0.1
    position: Numeric = 4.0
    width: Numeric = 1.0
    side: Numeric = 0.5

    POSITIVE: ClassVar = ("width", "side")

    def _near(self, base, u, depth, middle, width, side):
        """One step down and one up."""
        z = (base - middle) + u
        first, second = (_quintic_rise(z + k * width, side) for k in (0.5, -0.5))
        y, dy, d2y = (depth * (b - a) for a, b in zip(first, second, strict=True))
        return (y,), dy, d2y

    def _greatest_bend(self, radius, depth, middle, width, side):
        sides = jnp.where(side > width, 2.0, 1.0)  # they overlap
        return sides * RISE * jnp.abs(depth) / side**2


@pytree_dataclass
class Function:
    """A profile given as a function, scalar to scalar, in jax.numpy; static, so it must hash.

    Slope and second derivative by forward differentiation, in one evaluation. Every other function
    object compiles anew; numbers that it closes over are constants of the compiled program.
    """

    function: Callable = field(metadata={"static": True})

    def profile(self, x: Numeric) -> Profile:
        """The function and its first two derivatives at each x."""
        (x,) = as_floats(x)
        y, dy, d2y = jnp.vectorize(self._at)(x)
        return y, dy, d2y

    def _at(self, x: jax.Array) -> Profile:
        one = jnp.ones_like(x)

        def value(x: jax.Array) -> jax.Array:
            return jnp.asarray(self.function(x), x.dtype)

        (y, dy), (_, d2y) = jax.jvp(lambda x: jax.jvp(value, (x,), (one,)), (x,), (one,))
        return y, dy, d2y


def require_function(function: Any, points: np.ndarray) -> None:
    """Raise ValueError unless `function` can be a profile, as far as a few points tell."""
    accepted = "a hashable function of one number x [m] to one number y [m], in jax.numpy"
    try:
        hash(function)
        with jax.ensure_compile_time_eval():
            found = Function(function).profile(points)
        if (shape := found[0].shape[1:]) != ():
            raise TypeError(f"its value has shape {shape}")
    except Exception as error:  # Python's `if`, NumPy or math on a traced number, for one
        reason = str(error).partition("\n")[0][:120]
        raise ValueError(
            f"function = {shown(function)} fails: {reason}; accepted: {accepted}"
        ) from error
    if not is_concrete(found):
        return
    for name, values in zip(("height", "slope", "second derivative"), found, strict=True):
        values = np.asarray(values)
        if len(bad := np.flatnonzero(~np.isfinite(values))):
            given = f"the {name} of function at x = {points[bad[0]]:g} is {values[bad[0]]}"
            raise ValueError(f"{given}; accepted: finite")


def _bend(z: Values, joint: Values) -> Profile:
    """Integral of a slope rising from 0 to 1 over `joint` about z = 0: value, slope, second."""
    u = jnp.clip(z / joint + 0.5, 0.0, 1.0)
    past = jnp.maximum(z - joint / 2, 0.0)
    return joint * u**3 * (1 - u / 2) + past, u * u * (3 - 2 * u), 6 * u * (1 - u) / joint


def _quintic_rise(z: Values, length: Values) -> Profile:
    """Rise from 0 to 1 over `length` about z = 0: value, slope, second derivative."""
    u = jnp.clip(z / length + 0.5, 0.0, 1.0)
    value = u**3 * (10 - u * (15 - 6 * u))
    return value, 30 * (u * (1 - u)) ** 2 / length, 60 * u * (1 - u) * (1 - 2 * u) / length**2


@pytree_dataclass
class Near:
    """A ground with distances u forwards from `base` [m] and heights above the ground there [m].

    base: [...], any shape. anchor: the height there, in the parts that the shape gives. Every u has
    the shape [..., *more]. Build it with `seen_from`.
    """

    shape: Any
    base: Float[Array, "..."]
    anchor: tuple[Float[Array, "..."], ...]

    def profile(self, u: Values) -> Profile:
        """Height above the base [m], slope [-] and second derivative [1/m], u [m] from the base."""
        more = (1,) * (jnp.ndim(u) - self.base.ndim)
        base, *anchor = (jnp.reshape(v, (*v.shape, *more)) for v in (self.base, *self.anchor))
        parts, slope, second = parts_of(self.shape, base, u)
        height = sum(part - there for part, there in zip(parts, anchor, strict=True))
        return height, slope, second  # pyright: ignore[reportReturnType]

    def height(self, u: Values) -> Values:
        """Above the base [m]."""
        return self.profile(u)[0]

    @property
    def grain(self) -> Float[Array, "..."]:
        """The largest number [m] whose rounding a height near the base may carry, [...]."""
        size = jnp.abs(self.anchor[-1])
        return size if hasattr(self.shape, "near") else size + jnp.abs(self.base)


def seen_from(shape: Shape, base: Values) -> Near:
    """The ground from `base` [...] [m], a floating array."""
    parts, _, _ = parts_of(shape, base, jnp.zeros_like(base))
    return Near(shape, base, tuple(jnp.broadcast_to(part, base.shape) for part in parts))


def parts_of(shape: Any, base: Values, u: Values) -> tuple[tuple[Values, ...], Values, Values]:
    """Height in parts, large and exact ones first; slope; second derivative, at base + u.

    Of a shape that only knows `profile`, and so rounds base + u, one part.
    """
    if hasattr(shape, "near"):
        return shape.near(base, u)
    height, slope, second = shape.profile(base + u)
    return (height,), slope, second


def in_two(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Concrete numbers as what single precision holds of them, and the rest; both float64.

    A difference of two such numbers loses nothing in single precision when it is taken of the
    first parts, which is exact for neighbours, before the rests.
    """
    with np.errstate(over="ignore"):
        first = values.astype(np.float32).astype(np.float64)
    first = np.where(np.isfinite(first), first, 0.0)
    return first, values - first


def locate(
    knots: Float[Array, "knots"], rests: Float[Array, "knots"], even: bool, base: Values, u: Values
) -> tuple[Int[Array, "..."], Values, Values]:
    """The piece that base + u lies in, how far behind its left knot that is, and how far outside.

    knots + rests: [pieces + 1] increasing places [m], in two parts. Outside them the piece is the
    nearest, and its distance that of its end. outside: negative before the first knot.
    """
    count = knots.shape[-1] - 1
    before = ((base - knots[0]) - rests[0]) + u
    after = ((base - knots[-1]) - rests[-1]) + u
    outside = jnp.where(before < 0, before, jnp.where(after > 0, after, 0.0))
    if even:
        length = (knots[-1] - knots[0]) + (rests[-1] - rests[0])
        place = jnp.floor(before * (count / length)).astype(jnp.int32)
    else:
        place = jnp.searchsorted(knots + rests, base + u, side="right").astype(jnp.int32) - 1
    piece = jnp.clip(place, 0, count - 1)
    behind = ((base - knots[piece]) - rests[piece]) + u
    return piece, behind - outside, outside
