"""The biped's reward, and the numbers of a step that it is made of."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.numeric import all_finite
from stickslip.dynamics.status import Status
from stickslip.envs.biped.state import StepOutcome

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped import BipedModel, BipedState, Contact
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import Drawn

T = TypeVar("T")


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
) -> StepOutcome:
    """Outcome of a control step."""
    steps = jnp.asarray(after.steps) - jnp.asarray(before.steps)  # whole angles would lose digits
    turned = replace(after, steps=steps).crank_angle - before.phase
    walked = centre_of_mass(robot, after, before.steps)
    walked -= centre_of_mass(robot, before, before.steps)
    return StepOutcome(turned, walked, contact.slide_distance, contact.positive_work, copper_loss)


def fell(status: Int[Array, ""]) -> Bool[Array, ""]:
    """True if an episode ends in a failure."""
    return (status > Status.SLIP_ONSET) & (status != Status.STEP_COMPLETE)


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
