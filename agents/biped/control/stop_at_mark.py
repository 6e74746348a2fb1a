"""Walk to a mark along a gait and stop there with a crank-rate servo."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.control.optimal_gait import OptimalGait
from stickslip.agents.biped.control.speed_pi import CrankSpeedPI, PIMemory
from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams


@register_pytree
@dataclass(frozen=True)
class StopAtMark:
    """Follow a gait until it is time to brake, then a crank-rate servo down to a stand at the mark.

    Far off the gait is that of the mean crank rate `cruise` (OptimalGait). From where a constant
    crank deceleration `braking` leads to the mark the servo (CrankSpeedPI) is asked for
    sign(d) min(gain |d|, sqrt(2 braking |d| pi / step length)), d the way to the mark [m]. Without
    a mark it follows the gait for the commanded rate.

    cruise [rad/s]. braking [rad/s^2]. gain [rad/(s m)].
    """

    cruise: ArrayLike = 4.0
    braking: ArrayLike = 4.0
    gain: ArrayLike = 40.0
    gait: OptimalGait = field(default_factory=OptimalGait)
    servo: CrankSpeedPI = field(default_factory=lambda: CrankSpeedPI(acceleration=20.0))

    def validate(self) -> StopAtMark:
        """Return self, or raise ValueError naming the field."""
        for name in ("cruise", "braking", "gain"):
            rule = {"low": 0.0, "strict": True, "accepted": "finite, > 0"}
            require_number(name, getattr(self, name), **rule)
        for name, kind in (("gait", OptimalGait), ("servo", CrankSpeedPI)):
            require_kind(name, getattr(self, name), kind, f"a {kind.__name__}")
            getattr(self, name).validate()
        return self

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> PIMemory:
        """The servo's."""
        return self.servo.init(env_params, env_state)

    def act(
        self,
        memory: PIMemory,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[PIMemory, Float[Array, " 1"]]:
        """See Controller."""
        to_go = env_state.to_go
        if to_go is None:
            return memory, self.gait.act(None, obs, env_state, env_params)[1]
        dtype, way = to_go.dtype, jnp.abs(to_go)
        per_metre = np.pi / env_params.robot.step_length
        braked = jnp.sqrt(2 * self.braking * way * per_metre)
        asked = (jnp.sign(to_go) * jnp.minimum(self.gain * way, braked)).astype(dtype)
        begun = PIMemory(env_state.biped.crank_rate, jnp.zeros((), dtype))
        far = asked > jnp.asarray(self.cruise, dtype)
        walking = _asked(env_state, jnp.full_like(asked, self.cruise))
        _, steps = self.gait.act(None, obs, walking, env_params)
        after, stops = self.servo.act(memory, obs, _asked(env_state, asked), env_params)
        after = PIMemory(*(jnp.where(far, a, b) for a, b in zip(begun, after, strict=True)))
        return after, jnp.where(far, steps, stops)


def _asked(state: BipedEnvState, rate: Float[Array, ""]) -> BipedEnvState:
    """The state with another commanded rate [rad/s]."""
    return replace(state, drawn=state.drawn._replace(commanded_rate=rate))
