"""Hold the crank at the commanded rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.agents.biped.control.action import action_of
from stickslip.dynamics.biped.contact import sticking
from stickslip.dynamics.checks import require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.biped.state import drawn_robot

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams


class PIMemory(NamedTuple):
    """Memory of the PI controller."""

    reference: Float[Array, ""]
    """The crank rate asked for now [rad/s]."""
    integral: Float[Array, ""]
    """Its integral part [N m]."""


@register_pytree
@dataclass(frozen=True)
class CrankSpeedPI:
    """Hold the crank at the commanded rate, as a servo drive would: constant crank speed.

    torque = proportional x error + integral part + feed-forward, error = reference - crank rate.
    The reference rises from the rate at the start to the commanded rate by `acceleration`, so that
    the start does not topple the robot. The integral part grows by `integral` x error while the
    torque is inside the motor's limit or the error leads back there (anti-windup). feed_forward
    (0 to 1): share of the torque g Y + M' w^2 / 2 that a constant rate w takes with the foot at
    rest (MODEL 1.4), from the true phase and masses; without it these gains let the rate swing
    with gravity until the robot topples.

    proportional [N m s/rad]: at 50 Hz it must stay below 2 M / (control period) for the least M,
    about 2.9 for the default robot with the foot at rest and 0.8 with it sliding. integral
    [N m/rad]. acceleration [rad/s^2].
    """

    proportional: ArrayLike = 0.6
    integral: ArrayLike = 1.5
    acceleration: ArrayLike = 4.0
    feed_forward: ArrayLike = 1.0

    def validate(self) -> CrankSpeedPI:
        """Return self, or raise ValueError naming the field."""
        for name in ("proportional", "integral", "feed_forward"):
            require_number(name, getattr(self, name), low=0.0, accepted="finite, >= 0")
        require_number(
            "acceleration", self.acceleration, low=0.0, strict=True, accepted="finite, > 0"
        )
        return self

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> PIMemory:
        """The reference begins at the present rate."""
        rate = env_state.biped.crank_rate
        return PIMemory(rate, jnp.zeros_like(rate))

    def act(
        self,
        memory: PIMemory,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[PIMemory, Float[Array, " 1"]]:
        """See Controller."""
        rate, dtype = env_state.biped.crank_rate, env_state.biped.crank_rate.dtype
        period = jnp.asarray(env_params.control_period, dtype)
        limit = jnp.asarray(env_params.torque_limit, dtype)
        stride = self.acceleration * period
        change = jnp.clip(env_state.drawn.commanded_rate - memory.reference, -stride, stride)
        reference = memory.reference + change
        error = reference - rate
        robot = drawn_robot(env_state.drawn, env_params)
        inertia = robot.inertia.at(env_state.biped.phase)
        falling = sticking(robot, inertia, reference, jnp.zeros((), dtype)).crank_acceleration
        hold = -inertia.M * falling
        torque = self.proportional * error + memory.integral + self.feed_forward * hold
        winds_up = (jnp.abs(torque) > limit) & (torque * error > 0)
        growth = jnp.where(winds_up, 0.0, self.integral * period * error)
        after = PIMemory(reference, (memory.integral + growth).astype(dtype))
        return after, action_of(torque, env_params, env_state)
