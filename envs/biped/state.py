"""State of a biped episode, the draws that a reset puts into it, what a step earns, the shield."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedModel, BipedState, floor_position
from stickslip.dynamics.biped.contact import Friction, friction_on, patch_at
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.biped.model import load
from stickslip.dynamics.biped.safety import SafeTorque, nearest_safe
from stickslip.dynamics.pytrees import Number, all_finite, pytree_dataclass
from stickslip.dynamics.scene import Floor, Grip, Scene
from stickslip.dynamics.status import Status
from stickslip.envs.functional import Range, noisy, uniform

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped import Contact
    from stickslip.dynamics.biped.model import Inertia
    from stickslip.envs.biped.params import BipedEnvParams


T = TypeVar("T")
FALL_COST = 1.0
"""Cost of a fall in info["cost"]: as much as that of a slide over so many metres."""


class StepOutcome(NamedTuple):
    """Outcome of one control step."""

    turned: Float[Array, ""]
    """Crank angle [rad]."""
    walked: Float[Array, ""]
    """Distance of the centre of mass [m]."""
    slid: Float[Array, ""]
    """[m]"""
    positive_work: Float[Array, ""]
    """[J]"""
    copper_loss: Float[Array, ""]
    """[J]"""
    drive_loss: Float[Array, ""] | None = None
    """Of motor and gear without the winding, where they have an efficiency [J]."""

    @property
    def energy(self) -> Float[Array, ""]:
        """Positive motor work and losses [J]."""
        found = self.positive_work + self.copper_loss
        return found if self.drive_loss is None else found + self.drive_loss

    def info(self, period: Float[Array, ""]) -> dict[str, Array]:
        """Entries of info."""
        names = ("walked", "slid", "positive_work", "copper_loss")
        speed = {"walking_speed": self.walked / period}
        return speed | {name: getattr(self, name) for name in names}


class Totals(NamedTuple):
    """Sums over the episode, or what a step adds to them, see StepOutcome."""

    reward: Float[Array, ""]
    turned: Float[Array, ""]
    walked: Float[Array, ""]
    slid: Float[Array, ""]
    energy: Float[Array, ""]

    def info(self, elapsed: Int[Array, ""], duration: Float[Array, ""]) -> dict[str, Array]:
        """Entries of info about the episode after so many steps and seconds."""
        return {
            "episode_return": self.reward,
            "episode_length": elapsed,
            "episode_walked": self.walked,
            "episode_slid": self.slid,
            "episode_energy": self.energy,
            "episode_mean_rate": self.turned / duration,
        }


@pytree_dataclass
class BipedEnvState:
    """State of an episode. over: it has ended. mode: 0 sticks, +1 / -1 slides."""

    biped: BipedState
    mode: Int[Array, ""]
    elapsed: Int[Array, ""]
    """Control steps so far."""
    over: Bool[Array, ""]
    drawn: Drawn
    totals: Totals
    rests: Totals
    """Rounding errors of the totals (see `compensated`)."""
    asked: tuple[Float[Array, ""], ...]
    """Torques that a delay holds back, the earliest first [N m]."""

    @property
    def to_go(self) -> Float[Array, ""] | None:
        """Distance of the mark ahead of the centre of mass [m]; None without a mark."""
        return None if self.drawn.mark is None else self.drawn.mark - self.totals.walked


ROUNDING = 1e-3
"""Tolerance of an interval: a whole number of control periods ends on the last of them."""


class Commands(NamedTuple):
    """Commanded rates of an episode in which they change."""

    key: Array
    """Random key of later commands, as plain numbers."""
    interval: Array
    """Time from one command to the next [s]."""
    low: Array
    """Least and greatest of them [rad/s]."""
    high: Array


class Drawn(NamedTuple):
    """Draws of a reset; entries that are not randomised hold their neutral value."""

    friction: Array
    mass: Array
    payload: Array
    mean_rate: Array
    """Current command [rad/s]."""
    commands: Commands | None = None
    mark: Array | None = None
    """Distance of the mark ahead of the centre of mass's start [m]; None without one."""
    robot: Array | None = None
    """Place in the batch of robots; None without one."""
    noise: Array | None = None
    """Random key of the encoder's errors, as plain numbers; None without them."""


def draw(key: Array, params: BipedEnvParams) -> tuple[Drawn, Array, Array]:
    """Draw the start of an episode: draws, phase [rad] and crank rate [rad/s]."""
    ranges, robots = params.randomisation, np.shape(params.robot.own_mass)
    if ranges.robot is None and robots:
        raise ValueError(f"robot is a batch {robots}; accepted: one, vmap, Randomisation(robot=..)")
    dtype = jnp.result_type(params.robot.total_mass)

    def one(index: int, bounds: Range | None, otherwise: Number) -> Array:
        if bounds is None:
            return jnp.asarray(otherwise, dtype)
        return uniform(jax.random.fold_in(key, index), bounds, dtype)

    def whole(index: int, bounds: Range) -> Array:
        low, high = (jnp.asarray(bound).astype(jnp.int32) for bound in bounds)
        return jax.random.randint(jax.random.fold_in(key, index), (), low, high + 1)

    def chain(index: int) -> Array:
        return jax.random.key_data(jax.random.fold_in(key, index))

    commands = None
    if ranges.command_interval is not None and ranges.mean_rate is not None:
        ends = (jnp.asarray(bound, dtype) for bound in ranges.mean_rate)
        commands = Commands(chain(7), one(6, ranges.command_interval, 0.0), *ends)
    drawn = Drawn(
        friction=one(0, ranges.friction, 1.0),
        mass=one(1, ranges.mass, 1.0),
        payload=one(2, ranges.payload, 0.0),
        mean_rate=one(3, ranges.mean_rate, params.mean_rate),
        commands=commands,
        mark=None if params.mark is None else one(8, ranges.mark, params.mark),
        robot=None if ranges.robot is None else whole(9, ranges.robot),
        noise=None if params.encoder_noise is None else chain(10),
    )
    phase = one(4, ranges.phase, SUPPORT_START)
    phase = jnp.clip(phase, SUPPORT_START, SUPPORT_END)
    return drawn, phase, one(5, ranges.crank_rate, 0.0)


def commanded_at(drawn: Drawn, duration: Array) -> Drawn:
    """Commanded rate at a time since the episode's start [s]: another one each interval."""
    if drawn.commands is None:
        return drawn
    chain, interval, low, high = drawn.commands
    number = jnp.floor(duration / interval + ROUNDING).astype(jnp.int32)
    key = jax.random.fold_in(jax.random.wrap_key_data(chain), number)
    rate = uniform(key, (low, high), low.dtype)
    return drawn._replace(mean_rate=jnp.where(number == 0, drawn.mean_rate, rate))


def seen_angle(state: BipedEnvState, params: BipedEnvParams) -> Array:
    """The crank angle as the encoder shows it [rad]."""
    phase, noise = jnp.asarray(state.biped.phase), state.drawn.noise
    return noisy(phase, params.encoder_noise, noise, state.elapsed)


def drawn_robot(drawn: Drawn, params: BipedEnvParams) -> BipedModel:
    """The robot that the reset drew, with the masses that it drew."""
    ranges, (robot, unit) = params.randomisation, unloaded_robot(drawn, params)
    if ranges.mass is None and ranges.payload is None:
        return robot
    return load(robot, unit, drawn.mass, drawn.payload)


def unloaded_robot(drawn: Drawn, params: BipedEnvParams) -> tuple[BipedModel, Inertia | None]:
    """The robot that the reset drew, without the masses, and the inertia of 1 kg on its hip."""
    robot, unit = params.robot, params.unit_payload
    if drawn.robot is None:
        return robot, unit
    return robot.member(drawn.robot), None if unit is None else unit.member(drawn.robot)


def drawn_scene(drawn: Drawn, params: BipedEnvParams) -> Scene:
    """The scene with the friction that the reset drew; the payload is in the robot already."""
    scene, factor = params.scene, drawn.friction
    floor = jax.tree.map(lambda leaf: jnp.asarray(leaf, factor.dtype), scene.floor)
    if params.randomisation.friction is not None and not isinstance(floor, Grip):
        scaled = {name: factor * getattr(floor, name) for name in ("mu_kinetic", "mu_static")}
        floor = replace(floor, **scaled)
    return Scene(floor, None, scene.steps, scene.outputs)


def centre_of_mass(
    robot: BipedModel, biped: BipedState, steps_before: Int[Array, ""]
) -> Float[Array, ""]:
    """Place of the centre of mass along the floor [m], from the foothold after `steps_before`."""
    ahead = robot.inertia.moment_at(jnp.asarray(biped.phase)).X / robot.total_mass
    steps = (jnp.asarray(biped.steps) - steps_before).astype(ahead.dtype)
    return ahead + steps * robot.step_length + biped.foot_position


def outcome_of(
    robot: BipedModel,
    before: BipedState,
    after: BipedState,
    contact: Contact,
    copper_loss: Float[Array, ""],
    efficiency: Number | None = None,
) -> StepOutcome:
    """Outcome of a control step."""
    steps = jnp.asarray(after.steps) - jnp.asarray(before.steps)  # whole angles would lose digits
    turned = replace(after, steps=steps).crank_angle - before.phase
    walked = centre_of_mass(robot, after, before.steps)
    walked -= centre_of_mass(robot, before, before.steps)
    work, lost = contact.positive_work, None
    if efficiency is not None:
        lost = work * (1 / jnp.asarray(efficiency, work.dtype) - 1)
    return StepOutcome(turned, walked, contact.slide_distance, work, copper_loss, lost)


def fell(status: Int[Array, ""]) -> Bool[Array, ""]:
    """True if an episode ends in a failure."""
    return (status > Status.SLIP_ONSET) & (status != Status.STEP_COMPLETE)


def cost_of(slid: Array, status: Int[Array, ""]) -> Float[Array, ""]:
    """Cost of a step or an episode, apart from its reward: slid [m], and FALL_COST for a fall."""
    return slid + FALL_COST * fell(status).astype(slid.dtype)


def reward_terms(
    params: BipedEnvParams,
    robot: BipedModel,
    drawn: Drawn,
    outcome: StepOutcome,
    falls: Bool[Array, ""],
    period: Float[Array, ""],
    to_go: Float[Array, ""] | None = None,
) -> dict[str, Float[Array, ""]]:
    """The four terms of the reward of one control step; falls: whether the episode ends so; to_go:
    how far ahead the mark is after it [m], None without one."""
    speed = drawn.mean_rate / np.pi * robot.step_length
    if to_go is None or params.mark_width is None:
        kept = jnp.maximum(1 - jnp.abs(outcome.walked / period - speed) / speed, -1.0)
    else:
        kept = params.mark_width / (params.mark_width + jnp.abs(to_go))
    weight = robot.total_mass * robot.gravity
    return {
        "reward_tracking": params.tracking_weight * period * kept,
        "reward_slip": -params.slip_weight * outcome.slid / speed,
        "reward_energy": -params.energy_weight * outcome.energy / (weight * speed),
        "reward_fall": -params.fall_penalty * falls.astype(period.dtype),
    }


def marked(status: Int[Array, ""], numbers: T) -> tuple[Int[Array, ""], T]:
    """NON_FINITE, and nothing but zeros, where a number of an episode that goes on is none."""
    sound = all_finite(numbers)
    status = jnp.where(sound | (status > Status.SLIP_ONSET), status, Status.NON_FINITE)
    return status, jax.tree.map(lambda value: jnp.where(sound, value, 0.0), numbers)


def ground_force(contact: Contact, status: Int[Array, ""]) -> dict[str, Array]:
    """Force and zero-moment point; zero where the torque was no number."""
    force = {"friction_force": contact.friction_force, "normal_force": contact.normal_force}
    force |= {} if contact.zmp is None else {"zmp": contact.zmp}
    known = status != Status.NON_FINITE
    return {name: jnp.where(known, value, 0.0) for name, value in force.items()}


HOLDS = 10.0
"""Friction coefficient of a floor without slip: no start or stride needs more."""


def shielded(
    params: BipedEnvParams,
    robot: BipedModel,
    scene: Scene,
    state: BipedState,
    torque: Array,
    margin: float,
) -> SafeTorque:
    """`safe_torque` for one control period on the scene's own floor, the next foothold included.

    A torque that is no number stays one.
    """
    dtype = torque.dtype
    direction = jnp.where(state.crank_rate >= 0, 1.0, -1.0).astype(dtype)
    place = floor_position(robot, state)
    here = _friction(scene.floor, place, direction)
    ahead = _friction(scene.floor, place + direction * robot.step_length, direction)
    given = margin, params.control_period, params.torque_limit
    kept, period, limit = (jnp.asarray(one, dtype) for one in given)
    safe = nearest_safe(robot, state, torque, kept, period, limit, here, ahead.mu_static)
    return safe._replace(torque=jnp.where(jnp.isfinite(torque), safe.torque, torque))


def _friction(floor: Floor, place: Array, direction: Array) -> Friction:
    """Coefficients of the patch at a place of the floor [m], on an edge of the one ahead."""
    dtype = place.dtype
    if isinstance(floor, Grip):
        return Friction(*[jnp.full((), HOLDS, dtype)] * 2)
    return friction_on(floor, patch_at(floor, place, direction), dtype)
