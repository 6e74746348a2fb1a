"""Masses of a robot of uniform bars, from a length, a density, a hip and two feet."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping
    from types import ModuleType

    from jaxtyping import Array, Float

    Either = Array | np.ndarray
    """Array of the module that computes: jax.numpy or numpy."""

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

    mass: Float[Either, "*batch 13"]
    """[kg]"""
    centre: Float[Either, "*batch 13 2"]
    """Centres of mass in the links' frames [m]."""
    inertia: Float[Either, "*batch 13"]
    """About the centres [kg m^2]."""


class Hip(NamedTuple):
    """Mass [kg], centre along and across its frame, and the length that it is a bar of [m]."""

    mass: Float[Either, "*batch"]
    along: Float[Either, "*batch"]
    across: Float[Either, "*batch"]
    span: Float[Either, "*batch"]


def link_masses(
    xp: ModuleType,
    lengths: Mapping[str, Float[Either, "*batch"]],
    density: Float[Either, "*batch"],
    foot_mass: Float[Either, "*batch"],
    foot_inertia: Float[Either, "*batch"],
    hip: Hip,
) -> LinkMasses:
    """Masses, centres and inertias of feet, uniform bars and hip.

    xp: jax.numpy, or numpy where the numbers are at hand: with it nothing is compiled.
    lengths [m], by the names of BARS; density [kg/m]. A bar has its centre in the middle (the
    double crank on A) and I = m L^2 / 12, and so has the hip; the foot's centre is the ankle.
    """
    sides = [2 * lengths[name] if name == "crank" else lengths[name] for name in BARS]
    length = xp.stack(xp.broadcast_arrays(*sides), axis=-1)
    mass = density[..., None] * length
    middle = xp.where(np.arange(len(BARS)) == CRANK, 0.0, length) / 2
    ankle = xp.zeros_like(lengths["crank"])
    along = _join(xp, ankle, middle, hip.along)
    across = _join(xp, ankle, xp.zeros_like(middle), hip.across)
    return LinkMasses(
        mass=_join(xp, foot_mass, mass, hip.mass),
        centre=xp.stack([along, across], axis=-1),
        inertia=_join(
            xp, foot_inertia, mass * length**2 / 12, xp.asarray(hip.mass * hip.span**2 / 12)
        ),
    )


def _join(xp: ModuleType, foot: Either, bars: Either, hip: Either) -> Either:
    """Foot, the eleven bars and hip along the last axis, batch axes broadcast."""
    batch = np.broadcast_shapes(foot.shape, bars.shape[:-1], hip.shape)
    parts = [foot[..., None], bars, hip[..., None]]
    return xp.concatenate(
        [xp.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1
    )
