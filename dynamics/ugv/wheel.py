"""A wheel on the ground: the point of contact and the wheel's centre (eq. 38)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.ugv.track import Track

if TYPE_CHECKING:
    from jaxtyping import Array, Float


class Contact(NamedTuple):
    """A wheel's contact with the ground; vectors [..., 2] in the world frame."""

    x: Float[Array, ...]
    """Where the wheel touches [m]."""
    point: Float[Array, "... 2"]
    """The same as a point (x, f(x)) [m]."""
    centre: Float[Array, "... 2"]
    """The wheel's centre (s, g) of eq. (38) [m]."""
    tangent: Float[Array, "... 2"]
    """(cos beta, sin beta), along the ground forwards."""
    stretch: Float[Array, ...]
    """How far the centre moves for each metre along the ground [-]: 1 less radius over the ground's
    radius of curvature. Not positive: the ground is hollower than the wheel."""

    @property
    def slope_angle(self):
        """beta = atan f'(x) [rad]."""
        return jnp.arctan2(self.tangent[..., 1], self.tangent[..., 0])

    @property
    def normal(self):
        """(-sin beta, cos beta), out of the ground."""
        return jnp.stack([-self.tangent[..., 1], self.tangent[..., 0]], -1)


def contact(track: Track, x: Float[Array, ...], radius) -> Contact:
    """The contact at x (eq. 38, with f' for the f that is printed there); no check for a second."""
    f, df, d2f = track.profile(x)
    q = jnp.sqrt(1 + df**2)
    cos, sin = 1 / q, df / q
    return Contact(
        x=x,
        point=jnp.stack([x, f], -1),
        centre=jnp.stack([x - radius * sin, f + radius * cos], -1),
        tangent=jnp.stack([cos, sin], -1),
        stretch=1 - radius * d2f / q**3,
    )


def penetration(track: Track, wheel: Contact, radius, samples: int):
    """How deep the ground reaches into the wheel [m], at `samples` points below it; >= 0.

    Zero for a wheel that touches at one point. Ground narrower than 2 radius / samples may hide.
    """
    part = (jnp.arange(samples, dtype=wheel.x.dtype) + 0.5) / samples
    angle = jnp.pi * part
    across, down = -jnp.cos(angle), jnp.sin(angle)
    radius = jnp.asarray(radius, wheel.x.dtype)[..., None]
    x = wheel.centre[..., :1] + radius * across
    rim = wheel.centre[..., 1:] - radius * down
    return jnp.maximum(jnp.max((track.height(x) - rim) * down, axis=-1), 0)


def dot(a, b):
    """Scalar product of vectors [..., 2]."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def cross(a, b):
    """z component of the vector product of vectors [..., 2]."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
