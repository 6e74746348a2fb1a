"""Baselines that hold a torque or a crank rate, or stop at a mark. See agents/protocol.py."""

from __future__ import annotations

from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.agents.biped.prediction import OptimalGait, action_of, after_a_period
from stickslip.agents.protocol import Memoryless, Ruled
from stickslip.dynamics.biped.contact import Friction, sticking
from stickslip.dynamics.biped.safety import nearest_safe
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import BipedEnvState, centre_of_mass, drawn_robot
from stickslip.envs.functional import NON_NEGATIVE, POSITIVE

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.agents.protocol import Action, Obs
    from stickslip.dynamics.biped import BipedModel, BipedState, SafeTorque
    from stickslip.envs.biped.params import BipedEnvParams


@pytree_dataclass
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


@pytree_dataclass
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
    RULES: ClassVar = dict.fromkeys(("proportional", "integral", "feed_forward"), NON_NEGATIVE)
    RULES |= {"acceleration": POSITIVE}

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


BRAKING = (2.5, 4.0, 7.0)
"""Crank decelerations of the stops that are predicted [rad/s^2]."""
AHEAD = 60
"""Control periods of such a stop, at most."""
STANDS, SLOW, NEAR = 0.05, 1.0, 0.03
"""Crank rate [rad/s] of one who stands; crank rate and distance [m] of the servo's last bit."""


class StopMemory(NamedTuple):
    """Memory of `StopAtMark`."""

    servo: PIMemory
    braking: Float[Array, ""]
    """Crank deceleration of the last stop that is known to end before the mark [rad/s^2]."""


class _Stopping(NamedTuple):
    """A robot that keeps to safe torques; see `nearest_safe`."""

    robot: BipedModel
    margin: Array
    period: Array
    torque_limit: Array
    friction: Array

    def safe(self, state: BipedState, torque: Array) -> SafeTorque:
        """The nearest torque without slip or fall for a period."""
        robot, margin, period, limit, friction = self
        floor = Friction(friction, friction)
        return nearest_safe(robot, state, torque, margin, period, limit, floor, friction)

    def brake(self, state: BipedState, braking: Array) -> SafeTorque:
        """The safe torque nearest to a crank deceleration that does not turn the crank back."""
        inertia, rate = self.robot.inertia.at(state.phase), state.crank_rate
        idle = sticking(self.robot, inertia, rate**2, jnp.zeros_like(rate)).crank_acceleration
        return self.safe(state, inertia.M * (jnp.maximum(-braking, -rate / self.period) - idle))

    def after(self, state: BipedState, torque: Array) -> BipedState:
        """The predicted state after a period."""
        return after_a_period(self.robot, state, torque, self.period, self.friction)

    def stop(self, state: BipedState, braking: Array) -> tuple[BipedState, Array]:
        """Where braking ends, and whether it stands there and was safe throughout."""

        def onwards(_: int, carry: tuple[BipedState, Array]) -> tuple[BipedState, Array]:
            state, sound = carry
            now, stands = self.brake(state, braking), state.crank_rate <= STANDS
            after = jax.tree.map(partial(jnp.where, stands), state, self.after(state, now.torque))
            return after, sound & (stands | (now.status == Status.OK))

        last, sound = jax.lax.fori_loop(0, AHEAD, onwards, (state, jnp.ones((), bool)))
        return last, sound & (last.crank_rate <= STANDS)


@pytree_dataclass
class StopAtMark(Ruled):
    """Follow a gait while a stop before the mark remains possible without slip, then brake.

    Before each period of the gait of mean crank rate `cruise` (OptimalGait) the stops after it are
    predicted, one for each deceleration of BRAKING. Where one ends before the mark and is safe
    throughout, the gait goes on; else the last such stop is carried out. The rest of the way is a
    servo's (CrankSpeedPI), asked for sign(d) min(gain |d|, 1 rad/s), d the way to the mark [m].
    Every torque is the nearest one without slip or fall (`safe_torque`). Without a mark it follows
    the gait for the commanded rate.

    cruise [rad/s]. gain [rad/(s m)]. friction [-]: below the floor's. margin: see `safe_torque`.
    """

    cruise: ArrayLike = 6.0
    gain: ArrayLike = 40.0
    friction: ArrayLike = 0.057
    margin: ArrayLike = 0.02
    gait: OptimalGait = field(default_factory=OptimalGait)
    servo: CrankSpeedPI = field(default_factory=lambda: CrankSpeedPI(acceleration=20.0))
    RULES: ClassVar = dict.fromkeys(("cruise", "gain", "friction"), POSITIVE)
    RULES |= {"margin": {"low": 0.0, "high": 1.0, "accepted": "a share from 0 to 1"}}

    def suited_to(self, env_params: BipedEnvParams) -> StopAtMark:
        """The controller with gaits of these parameters' robot."""
        return replace(self, gait=self.gait.suited_to(env_params))

    def validate(self) -> StopAtMark:
        for name, kind in (("gait", OptimalGait), ("servo", CrankSpeedPI)):
            require_kind(name, getattr(self, name), kind, f"a {kind.__name__}")
            getattr(self, name).validate()
        return super().validate()

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> StopMemory:
        """The servo's, and the gentlest stop."""
        servo = self.servo.init(env_params, env_state)
        return StopMemory(servo, jnp.full_like(servo.reference, BRAKING[0]))

    def act(
        self, memory: StopMemory, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[StopMemory, Action]:
        """See Controller."""
        to_go, biped = env_state.to_go, env_state.biped
        if to_go is None:
            return memory, self.gait.act(None, obs, env_state, env_params)[1]
        numbers = self.margin, env_params.control_period, env_params.torque_limit, self.friction
        robot, dtype = drawn_robot(env_state.drawn, env_params), to_go.dtype
        stopping = _Stopping(robot, *(jnp.asarray(one, dtype) for one in numbers))
        limit, levels = stopping.torque_limit, jnp.asarray(BRAKING, dtype)

        walking = _asked(env_state, jnp.full_like(to_go, self.cruise))
        _, action = self.gait.act(None, obs, walking, env_params)
        gait = stopping.safe(biped, limit * action[0]).torque
        ends, sound = jax.vmap(stopping.stop, (None, 0))(stopping.after(biped, gait), levels)
        there = jax.vmap(lambda one: centre_of_mass(robot, one, biped.steps))(ends)
        possible = sound & (there - centre_of_mass(robot, biped, biped.steps) <= to_go)
        goes = jnp.any(possible) & (to_go > NEAR)
        brakes = ~goes & (biped.crank_rate > SLOW)

        rate = jnp.sign(to_go) * jnp.minimum(self.gain * jnp.abs(to_go), SLOW)
        asked = _asked(env_state, rate.astype(dtype))
        after, action = self.servo.act(memory.servo, obs, asked, env_params)
        slowly = stopping.safe(biped, limit * action[0]).torque
        braked = stopping.brake(biped, memory.braking).torque
        torque = jnp.where(goes, gait, jnp.where(brakes, braked, slowly))

        begun = PIMemory(biped.crank_rate, jnp.zeros_like(biped.crank_rate))
        servo = jax.tree.map(partial(jnp.where, goes | brakes), begun, after)
        braking = jnp.where(goes, levels[jnp.argmax(possible)], memory.braking)
        return StopMemory(servo, braking), action_of(torque, env_params, env_state)


def _asked(state: BipedEnvState, rate: Float[Array, ""]) -> BipedEnvState:
    """The state with another commanded rate [rad/s]."""
    return replace(state, drawn=state.drawn._replace(mean_rate=rate))
