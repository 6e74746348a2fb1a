"""Random draws of the UGV's reset, and the ground and friction that follow from them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.ugv import Odometer
from stickslip.envs.ugv.randomisation import uniform

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.envs.ugv.params import UGVEnvParams


class UGVDrawn(NamedTuple):
    """Draws of a reset; None for what is not drawn."""

    odometer: Odometer | None
    friction: Float[Array, ""] | None
    noise: Array | None
    """Random key of the preview's noise, as plain numbers."""


def draw(key: Array, params: UGVEnvParams) -> tuple[UGVDrawn, Float[Array, " 2"]]:
    """Draw the start of an episode: draws and leg angles [rad]."""
    ranges, dtype = params.randomisation, jnp.result_type(params.start)
    keys = [jax.random.fold_in(key, index) for index in range(4)]
    odometer = friction = noise = None
    if ranges.track is not None:
        odometer = ranges.track.draw(keys[0], params.track.start, params.track.end, dtype)
    if ranges.friction is not None:
        friction = uniform(keys[1], ranges.friction, dtype)
    angles = jnp.asarray(params.start_angles, dtype)
    if ranges.start_angles is not None:
        angles = uniform(keys[2], ranges.start_angles, dtype, (2,))
    if params.preview_noise is not None:
        noise = jax.random.key_data(keys[3])
    return UGVDrawn(odometer, friction, noise), angles


def ground(drawn: UGVDrawn, params: UGVEnvParams) -> tuple[Odometer, Any]:
    """The episode's ground, with its arc length, and friction coefficient."""
    odometer = params.odometer if drawn.odometer is None else drawn.odometer
    return odometer, params.friction if drawn.friction is None else drawn.friction
