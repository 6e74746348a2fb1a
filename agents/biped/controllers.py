"""Baseline controllers, to measure a policy against. See stickslip.agents.protocol."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.prediction import ComputedTorque, OptimalGait, action_of
from stickslip.agents.protocol import Controller, Memoryless, Ruled
from stickslip.dynamics.biped.contact import sticking
from stickslip.dynamics.checks import require_choice, require_kind
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.biped.state import BipedEnvState, drawn_robot
from stickslip.envs.functional import NON_NEGATIVE, POSITIVE

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.agents.protocol import Action, Obs
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams


@register_pytree
@dataclass(frozen=True)
class ConstantTorque(Memoryless):
    """The same torque whatever happens (the chapter's Figs. 13 and 14).

    torque [N m]: below 0.84 from rest the default robot does not get over its first step; above 1.0
    it topples at once. Nothing takes out what the motor puts in, so that where the foot holds, each
    step is quicker than the one before.
    """

    torque: ArrayLike = 0.9
    RULES: ClassVar = {"torque": {"accepted": "a finite torque [N m]"}}

    def act(
        self, memory: None, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[None, Action]:
        """See Controller."""
        return memory, action_of(self.torque, env_params, env_state)


class PIMemory(NamedTuple):
    """Memory of the PI controller."""

    reference: Float[Array, ""]
    """The crank rate asked for now [rad/s]."""
    integral: Float[Array, ""]
    """Its integral part [N m]."""


@register_pytree
@dataclass(frozen=True)
class CrankSpeedPI(Ruled):
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
    RULES: ClassVar = {
        **dict.fromkeys(("proportional", "integral", "feed_forward"), NON_NEGATIVE),
        "acceleration": POSITIVE,
    }

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> PIMemory:
        """The reference begins at the present rate."""
        rate = env_state.biped.crank_rate
        return PIMemory(rate, jnp.zeros_like(rate))

    def act(
        self, memory: PIMemory, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[PIMemory, Action]:
        """See Controller."""
        rate, dtype = env_state.biped.crank_rate, env_state.biped.crank_rate.dtype
        period = jnp.asarray(env_params.control_period, dtype)
        limit = jnp.asarray(env_params.torque_limit, dtype)
        stride = self.acceleration * period
        change = jnp.clip(env_state.drawn.mean_rate - memory.reference, -stride, stride)
        reference = memory.reference + change
        error = reference - rate
        robot = drawn_robot(env_state.drawn, env_params)
        inertia = robot.inertia.at(env_state.biped.phase)
        falling = sticking(robot, inertia, reference**2, jnp.zeros((), dtype)).crank_acceleration
        hold = -inertia.M * falling
        torque = self.proportional * error + memory.integral + self.feed_forward * hold
        winds_up = (jnp.abs(torque) > limit) & (torque * error > 0)
        growth = jnp.where(winds_up, 0.0, self.integral * period * error)
        after = PIMemory(reference, (memory.integral + growth).astype(dtype))
        return after, action_of(torque, env_params, env_state)


@register_pytree
@dataclass(frozen=True)
class StopAtMark(Ruled):
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
    RULES: ClassVar = dict.fromkeys(("cruise", "braking", "gain"), POSITIVE)

    def suited_to(self, env_params: BipedEnvParams) -> StopAtMark:
        """The controller with gaits of these parameters' robot."""
        return replace(self, gait=self.gait.suited_to(env_params))

    def validate(self) -> StopAtMark:
        """Return self, or raise ValueError naming the field."""
        for name, kind in (("gait", OptimalGait), ("servo", CrankSpeedPI)):
            require_kind(name, getattr(self, name), kind, f"a {kind.__name__}")
            getattr(self, name).validate()
        return super().validate()

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> PIMemory:
        """The servo's."""
        return self.servo.init(env_params, env_state)

    def act(
        self, memory: PIMemory, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[PIMemory, Action]:
        """See Controller."""
        to_go = env_state.to_go
        if to_go is None:
            return memory, self.gait.act(None, obs, env_state, env_params)[1]
        dtype, distance = to_go.dtype, jnp.abs(to_go)
        per_metre = np.pi / env_params.robot.step_length
        braked = jnp.sqrt(2 * self.braking * distance * per_metre)
        asked = (jnp.sign(to_go) * jnp.minimum(self.gain * distance, braked)).astype(dtype)
        begun = PIMemory(env_state.biped.crank_rate, jnp.zeros((), dtype))
        far = asked > jnp.asarray(self.cruise, dtype)
        walking = _asked(env_state, jnp.full_like(asked, self.cruise))
        _, steps = self.gait.act(None, obs, walking, env_params)
        after, stops = self.servo.act(memory, obs, _asked(env_state, asked), env_params)
        after = PIMemory(*(jnp.where(far, a, b) for a, b in zip(begun, after, strict=True)))
        return after, jnp.where(far, steps, stops)


def _asked(state: BipedEnvState, rate: Float[Array, ""]) -> BipedEnvState:
    """The state with another commanded rate [rad/s]."""
    return replace(state, drawn=state.drawn._replace(mean_rate=rate))


CONTROLLERS = {
    "constant-torque": ConstantTorque,
    "crank-speed-pi": CrankSpeedPI,
    "computed-torque": ComputedTorque,
    "optimal-gait": OptimalGait,
    "stop-at-mark": StopAtMark,
}
"""The baselines by the names that the command line knows, BIPED_BASELINES."""


def baseline(name: str, env: BipedEnv) -> Controller[Any, BipedEnvState, BipedEnvParams]:
    """See Machine; a baseline suits every environment."""
    require_choice("controller", name, CONTROLLERS)
    return CONTROLLERS[name]()
