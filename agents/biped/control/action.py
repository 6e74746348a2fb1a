"""Torques as actions of the biped's environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState


def action_of(
    torque: ArrayLike, env_params: BipedEnvParams, env_state: BipedEnvState
) -> Float[Array, " 1"]:
    """The action for a torque [N m], clipped to the motor's limit, in the state's type."""
    dtype = env_state.biped.crank_rate.dtype
    share = jnp.asarray(torque, dtype) / jnp.asarray(env_params.torque_limit, dtype)
    return jnp.clip(share, -1.0, 1.0)[None]
