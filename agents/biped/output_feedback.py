"""A baseline whose only sensor is an encoder: Kalman filters, a gait and safe torques."""

from __future__ import annotations

from dataclasses import field, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.controllers import StopAtMark, StopMemory
from stickslip.agents.biped.prediction import SHARE, action_of, after_a_period
from stickslip.agents.protocol import Ruled
from stickslip.dynamics.biped.contact import Friction
from stickslip.dynamics.biped.estimation import Belief, Noise, initial_belief, mixed, observe
from stickslip.dynamics.biped.links import SUPPORT_START
from stickslip.dynamics.biped.safety import nearest_safe
from stickslip.dynamics.checks import require_kind
from stickslip.dynamics.pytrees import pytree_dataclass
from stickslip.dynamics.scene import Uniform
from stickslip.envs.biped.state import BipedEnvState, drawn_robot, seen_angle, unloaded_robot
from stickslip.envs.functional import NON_NEGATIVE, POSITIVE, Range

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.agents.protocol import Action, Obs
    from stickslip.envs.biped.params import BipedEnvParams

FRICTIONS = np.geomspace(0.015, 0.5, 12)
"""Static frictions of the filters."""


class Estimate(NamedTuple):
    """What the angles read so far tell."""

    bank: Belief
    """Of every friction [n]; angles without the first `steps` steps."""
    probabilities: Float[Array, " n"]
    steps: Int[Array, ""]

    def put_into(self, env_state: BipedEnvState) -> BipedEnvState:
        """The environment's state with the estimates in place of what no sensor shows."""
        angle, rate, velocity = self.bank.mean[jnp.argmax(self.probabilities), :3]
        payload, factor = self.probabilities @ self.bank.mean[:, 3:5]
        more = jnp.floor((angle - SUPPORT_START) / np.pi)
        phase, steps = angle - np.pi * more, self.steps + more.astype(self.steps.dtype)
        moving = {"phase": phase, "crank_rate": rate, "foot_velocity": velocity}
        biped = replace(env_state.biped, steps=steps, **moving)
        drawn = env_state.drawn._replace(payload=payload, mass=factor)
        return replace(env_state, biped=biped, drawn=drawn)

    def friction(self, quantile: ArrayLike) -> Float[Array, ""]:
        """A quantile of the floor's static friction."""
        below = jnp.searchsorted(jnp.cumsum(self.probabilities), quantile)
        frictions = jnp.asarray(FRICTIONS, self.probabilities.dtype)
        return frictions[jnp.minimum(below, len(FRICTIONS) - 1)]


class FeedbackMemory(NamedTuple):
    """Memory of `OutputFeedback`."""

    estimate: Estimate
    friction: Float[Array, ""]
    """Static friction that the last torque might use [-]."""
    torque: Float[Array, ""]
    """The last one [N m]."""
    begun: Bool[Array, ""]
    walker: StopMemory


@pytree_dataclass
class OutputFeedback(Ruled):
    """Walk and stop by an encoder of the crank alone, on a floor and with a load not known.

    A bank of extended Kalman filters, one for each of FRICTIONS, estimates the state and the load
    from the angle read and the torque applied (`dynamics.biped.estimation.observe`); friction
    probabilities follow (interacting multiple models: the floor may change). The controller acts on
    the likeliest filter's state (certainty equivalence), and the torque is the nearest one under
    which a foot on the estimated friction neither slips nor tips (`safe_torque`).

    controller: what is followed. noise: standard deviation of an angle read [rad], which this
    controller adds to the environment's; by default a 12-bit encoder's. disturbance: of the torque,
    for what the filters' model leaves out [N m]. changes: rate at which the floor is expected to
    become another [1/s]. ratio: kinetic over static friction, taken to be known. quantile: share of
    the probability below the friction taken for the floor's; reserve: share of that friction that
    may be used, and most: no more than this [-].

    Read of the environment: the angle (and at the start its mean slope over the period before), the
    ranges of the loads that resets draw, the commanded rate and the distance to a mark. The foot
    rests at the start. Torques that a delay holds back are known, and what they will do is
    predicted. Masses that no reset draws are known. Neglected: what a motor's power limit
    or a shield of the environment changes of the torque.
    """

    controller: StopAtMark = field(default_factory=StopAtMark)
    noise: ArrayLike = 4.4e-4
    disturbance: ArrayLike = 0.02
    changes: ArrayLike = 0.5
    ratio: ArrayLike = 0.83
    quantile: ArrayLike = 0.2
    reserve: ArrayLike = 0.95
    most: ArrayLike = 0.06
    RULES: ClassVar = dict.fromkeys(("noise", "disturbance", "most"), POSITIVE)
    RULES |= {"changes": NON_NEGATIVE} | dict.fromkeys(("ratio", "quantile", "reserve"), SHARE)

    def suited_to(self, env_params: BipedEnvParams) -> OutputFeedback:
        """The controller with gaits of these parameters' robot."""
        return replace(self, controller=self.controller.suited_to(env_params))

    def validate(self) -> OutputFeedback:
        require_kind("controller", self.controller, StopAtMark, "a StopAtMark")
        self.controller.validate()
        return super().validate()

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> FeedbackMemory:
        """Beliefs of the first angle read, and of what the environment may have drawn."""
        dtype, n = env_state.biped.phase.dtype, len(FRICTIONS)
        drawn, zero = env_params.randomisation, jnp.zeros((), dtype)
        load = _moments(drawn.payload, 0.0, dtype), _moments(drawn.mass, 1.0, dtype)
        means, spread = (jnp.stack([*one, zero, zero, zero]) for one in zip(*load, strict=True))
        angle, error = self._read(env_state, env_params, env_state.biped.steps)
        slope = np.sqrt(2) / jnp.asarray(env_params.control_period, dtype)
        read = env_state.biped.crank_rate + slope * (angle - env_state.biped.phase)
        deviations = error * jnp.stack([jnp.ones((), dtype), slope])
        belief = initial_belief(angle, read, deviations, means, spread)
        bank = jax.tree.map(lambda one: jnp.broadcast_to(one, (n, *one.shape)), belief)
        estimate = Estimate(bank, jnp.full(n, 1 / n, dtype), env_state.biped.steps)
        walker = self.controller.init(env_params, estimate.put_into(env_state))
        return FeedbackMemory(estimate, zero, zero, jnp.zeros((), bool), walker)

    def act(
        self, memory: FeedbackMemory, obs: Obs, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> tuple[FeedbackMemory, Action]:
        """See Controller."""
        dtype = env_state.biped.phase.dtype
        after = self._observed(memory, env_state, env_params)
        estimate = jax.tree.map(partial(jnp.where, memory.begun), after, memory.estimate)
        mu = jnp.minimum(self.reserve * estimate.friction(self.quantile), self.most).astype(dtype)
        gait = replace(self.controller.gait, friction=mu)
        controller = replace(self.controller, friction=mu, gait=gait)
        numbers = controller.margin, env_params.control_period, env_params.torque_limit
        margin, period, limit = (jnp.asarray(one, dtype) for one in numbers)
        state, waiting = estimate.put_into(env_state), env_state.asked
        robot, floor = drawn_robot(state.drawn, env_params), Friction(mu, mu * self.ratio)
        for torque in waiting:  # of a delayed motor
            biped = after_a_period(robot, state.biped, torque, period, floor.mu_kinetic)
            state = replace(state, biped=biped)
        walker, action = controller.act(memory.walker, obs, state, env_params)

        asked = robot, state.biped, limit * action[0], margin, period, limit, floor, mu
        action = action_of(nearest_safe(*asked).torque, env_params, env_state)
        torque = (*waiting, limit * action[0])[0]
        return FeedbackMemory(estimate, mu, torque, jnp.ones((), bool), walker), action

    def _observed(
        self, memory: FeedbackMemory, env_state: BipedEnvState, env_params: BipedEnvParams
    ) -> Estimate:
        """The estimate after another angle read, a period after the one before."""
        bank, probabilities, steps = memory.estimate
        dtype = probabilities.dtype
        numbers = env_params.control_period, self.changes, self.disturbance, self.ratio
        period, changes, disturbance, ratio = (jnp.asarray(one, dtype) for one in numbers)
        bank, prior = mixed(bank, probabilities, changes * period)
        angle, noise = self._read(env_state, env_params, steps)
        drawn = env_params.randomisation
        ranges = {"payload": drawn.payload, "mass_factor": drawn.mass}
        loads = tuple(name for name, ends in ranges.items() if ends is not None)
        robot = unloaded_robot(env_state.drawn, env_params)

        def one(mu: Array, belief: Belief) -> Belief:
            given = robot, Uniform(mu, ratio * mu), belief, memory.torque, period, angle
            return observe(*given, Noise(noise, disturbance), loads=loads)

        bank = jax.vmap(one)(jnp.asarray(FRICTIONS, dtype), bank)
        likely = jax.nn.softmax(jnp.log(prior + jnp.finfo(dtype).tiny) - bank.misfit / 2)
        turned = jnp.floor((likely @ bank.mean[:, 0] - SUPPORT_START) / np.pi)
        bank = bank._replace(mean=bank.mean.at[:, 0].add(-np.pi * turned))
        return Estimate(bank, likely, steps + turned.astype(steps.dtype))

    def _read(
        self, env_state: BipedEnvState, env_params: BipedEnvParams, steps: Int[Array, ""]
    ) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """The encoder's angle less that of some steps, its noise drawn by the angle, and the
        standard deviation of all its noise [rad]."""
        phase = seen_angle(env_state, env_params)
        bits = jax.lax.bitcast_convert_type(phase.astype(jnp.float32), jnp.uint32)
        noise = jax.random.normal(jax.random.fold_in(jax.random.key(0), bits), (), phase.dtype)
        turned = np.pi * (env_state.biped.steps - steps).astype(phase.dtype)
        own = 0.0 if env_params.encoder_noise is None else env_params.encoder_noise
        error = jnp.hypot(jnp.asarray(self.noise, phase.dtype), jnp.asarray(own, phase.dtype))
        return (phase + turned + self.noise * noise).astype(phase.dtype), error


def _moments(ends: Range | None, otherwise: float, dtype: jnp.dtype) -> tuple[Array, Array]:
    """Mean and standard deviation of a uniform draw, or of what is not drawn."""
    low, high = (jnp.asarray(one, dtype) for one in ends or (otherwise, otherwise))
    return (low + high) / 2, (high - low) / np.sqrt(12)
