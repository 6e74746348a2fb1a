"""The mass of a robot of uniform bars: what a length, a density, a hip and two feet make of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import Array, Float

BARS = (
    "tibia",
    "femur",
    "lower_tendon",
    "offset",
    "upper_tendon",
    "rod",
    "crank",
    "rocker",
    "stabiliser",
    "tibia",
    "femur",
)
"""The length of each link between foot and hip, in LINKS' order. The crank has two arms."""
CRANK = BARS.index("crank")


class LinkMasses(NamedTuple):
    """Fields of BipedParams, links in LINKS' order."""

    mass: Float[Array, "*batch 13"]
    """[kg]"""
    centre: Float[Array, "*batch 13 2"]
    """In the links' frames [m]."""
    inertia: Float[Array, "*batch 13"]
    """About the centres [kg m^2]."""


class Hip(NamedTuple):
    """Mass [kg], centre along and across its frame, and the length that it is a bar of [m]."""

    mass: Float[Array, "*batch"]
    along: Float[Array, "*batch"]
    across: Float[Array, "*batch"]
    span: Float[Array, "*batch"]


def link_masses(
    lengths: Mapping[str, Float[Array, "*batch"]],
    density: Float[Array, "*batch"],
    foot_mass: Float[Array, "*batch"],
    foot_inertia: Float[Array, "*batch"],
    hip: Hip,
) -> LinkMasses:
    """Masses, centres and inertias of feet, uniform bars and hip.

    lengths [m], by the names of BARS; density [kg/m]. A bar has its centre in the middle (the
    double crank on A) and I = m L^2 / 12, and so has the hip; the foot's centre is the ankle.
    """
    sides = [2 * lengths[name] if name == "crank" else lengths[name] for name in BARS]
    length = jnp.stack(jnp.broadcast_arrays(*sides), axis=-1)
    mass = density[..., None] * length
    middle = length.at[..., CRANK].set(0.0) / 2
    ankle = jnp.zeros_like(lengths["crank"])
    along = _join(ankle, middle, hip.along)
    across = _join(ankle, jnp.zeros_like(middle), hip.across)
    return LinkMasses(
        mass=_join(foot_mass, mass, hip.mass),
        centre=jnp.stack([along, across], axis=-1),
        inertia=_join(foot_inertia, mass * length**2 / 12, hip.mass * hip.span**2 / 12),
    )


def _join(foot: Array, bars: Array, hip: Array) -> Array:
    """Foot, the eleven bars and hip along the last axis, batch axes broadcast."""
    batch = jnp.broadcast_shapes(foot.shape, bars.shape[:-1], hip.shape)
    parts = [foot[..., None], bars, hip[..., None]]
    return jnp.concatenate(
        [jnp.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1
    )
