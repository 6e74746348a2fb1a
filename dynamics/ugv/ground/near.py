"""The ground as seen from a place on it, where all that a vehicle needs is small.

Everything about a vehicle follows from differences of x and of height over a metre or two. Taken
from places near by, they keep their digits however far from x = 0 and y = 0 the ground lies; taken
from world coordinates they lose what those round off, in single precision 6e-5 m at 1000 m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.ugv.ground.shapes import Profile, Shape, Values


@register_pytree
@dataclass(frozen=True)
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
    knots: Float[Array, "knots"],
    rests: Float[Array, "knots"],
    even: bool,
    base: Values,
    u: Values,
) -> tuple[Int[Array, "..."], Values, Values]:
    """The piece that base + u lies in, how far behind its left knot that is, and how far outside.

    knots + rests: [pieces + 1] increasing places [m], in two parts. Outside the first or the last
    of them the piece is the nearest, and its distance that of its end. outside: negative before
    the first knot.
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
