"""Computed torque: walk so that the floor need not push, however slippery it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.control.action import action_of
from stickslip.agents.biped.control.admissible import admissible
from stickslip.agents.biped.control.secant import after_a_period, secant
from stickslip.dynamics.biped import SUPPORT_END, BipedModel
from stickslip.dynamics.biped.contact import Motion, sticking
from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.biped.state import drawn_robot

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped import BipedState
    from stickslip.envs.biped.env import BipedEnvState
    from stickslip.envs.biped.params import BipedEnvParams


class Schedule(NamedTuple):
    """When the next exchange of support is due."""

    due: Float[Array, ""]
    """From now [control periods]."""
    steps: Int[Array, ""]
    """Exchanges when this was noted down."""


@register_pytree
@dataclass(frozen=True)
class ComputedTorque:
    """Hold P(theta) x crank rate constant: in steady walking the floor need not push at all.

    With the foot at rest the friction is the change of the horizontal momentum, f = d(P w)/dt
    (MODEL 1.4). P is m times the slope of the centre of mass's way over the crank angle, so P w = c
    means that the centre of mass travels at constant speed. Over a step it travels one step length
    s, in the time pi / (commanded rate): hence c = m s x commanded rate / pi.

    The torque is held for a control period, so it is chosen by prediction: the torque that brings
    P w to its target at the end of the coming period, found by secant steps on the stepped dynamics
    of a foot at rest. P has a kink at the exchange of support, which a held torque cannot follow;
    so the walk is timed, within half a control period a step, such that exchanges fall on control
    instants.

    Far from its target (a start from rest, a slide, a push) P w moves by no more than the friction
    and the foot's edges allow, both with margin: |f| <= friction x N, and the zero-moment point
    within `footing` of the way to toe and heel. A slide is predicted with `friction` for its drag.

    It reads phase, rates, masses and commanded rate of the true state and never the floor's
    friction. friction [-]: the coefficient it relies on when it changes speed, to be set below the
    floor's static one. footing [-]: share of the foot it relies on, in (0, 1].
    The default robot's motor (4 N m) can follow up to about 4 rad/s.
    """

    friction: ArrayLike = 0.04
    footing: ArrayLike = 0.8

    def validate(self) -> ComputedTorque:
        """Return self, or raise ValueError naming the field."""
        require_number("friction", self.friction, low=0.0, strict=True, accepted="finite, > 0")
        require_number("footing", self.footing, low=0.0, strict=True, accepted="in (0, 1]")
        if is_concrete(self.footing) and np.any(np.asarray(self.footing) > 1):
            raise ValueError(f"footing = {self.footing} is not accepted; accepted: in (0, 1]")
        return self

    def init(self, env_params: BipedEnvParams, env_state: BipedEnvState) -> Schedule:
        """Nothing is scheduled yet: infinitely far off, so that the first step sets it."""
        return Schedule(jnp.full_like(env_state.biped.crank_rate, jnp.inf), env_state.biped.steps)

    def act(
        self,
        memory: Schedule,
        obs: Float[Array, " obs"],
        env_state: BipedEnvState,
        env_params: BipedEnvParams,
    ) -> tuple[Schedule, Float[Array, " 1"]]:
        """See Controller."""
        dtype = env_state.biped.crank_rate.dtype
        period = jnp.asarray(env_params.control_period, dtype)
        robot, biped = drawn_robot(env_state.drawn, env_params), env_state.biped
        memory, cruise = _timed(memory, robot, env_state, period)
        inertia = robot.inertia.at(biped.phase)
        idle = sticking(robot, inertia, biped.crank_rate, jnp.zeros((), dtype))
        driven = sticking(robot, inertia, biped.crank_rate, jnp.ones((), dtype))
        now = inertia.P * biped.crank_rate
        low, high = self._admissible(robot, biped, idle, driven)
        target = jnp.clip(cruise, now + period * low, now + period * high)
        per_torque = driven.friction_force - idle.friction_force
        guess = ((target - now) / period - idle.friction_force) / per_torque
        slope = period * per_torque
        torque = _torque_to_reach(target, guess, slope, robot, self.friction, biped, period)
        return memory, action_of(torque, env_params, env_state)

    def _admissible(self, robot: BipedModel, biped: BipedState, idle: Motion, driven: Motion):
        """Least and greatest friction force within the cone and the foot's edges [N].

        idle, driven: the foot at rest, under no torque and under 1 N m; all is linear in between.
        """
        lowest, highest = admissible(robot, biped, idle, driven, self.friction, self.footing)
        per_torque = driven.friction_force - idle.friction_force
        return tuple(idle.friction_force + per_torque * torque for torque in (lowest, highest))


def _timed(
    memory: Schedule, robot: BipedModel, env_state: BipedEnvState, period: Float[Array, ""]
) -> tuple[Schedule, Float[Array, ""]]:
    """The schedule brought up to date, and the momentum P w to cruise at [kg m/s].

    The centre of mass's way is measured in periods at the commanded speed. A schedule that is off
    by more than a period is dropped for the free one, which is the way to go itself.
    """
    biped = env_state.biped
    way = robot.total_mass * robot.step_length
    speed = way * env_state.drawn.commanded_rate / np.pi
    per_step = way / (speed * period)
    end = robot.inertia.moment_at(jnp.full_like(biped.phase, SUPPORT_END)).X
    to_go = (end - robot.inertia.moment_at(biped.phase).X) / (speed * period)
    exchanged = (biped.steps - memory.steps).astype(to_go.dtype)
    due = memory.due - 1 + per_step * exchanged
    passing = to_go < 0.5  # the exchange falls on this instant, give or take: look at the next one
    to_go = to_go + jnp.where(passing, per_step, 0.0)
    next_due = due + jnp.where(passing, per_step, 0.0)
    on_time = jnp.abs(to_go - next_due) < 1.0
    next_due = jnp.where(on_time, next_due, to_go)
    due = next_due - jnp.where(passing, per_step, 0.0)
    cruise = speed * to_go / jnp.maximum(jnp.round(next_due), 1.0)
    return Schedule(due, biped.steps), cruise


def _torque_to_reach(
    target: Float[Array, ""],
    guess: Float[Array, ""],
    slope: Float[Array, ""],
    robot: BipedModel,
    friction: ArrayLike,
    biped: BipedState,
    period: Float[Array, ""],
) -> Float[Array, ""]:
    """The torque [N m] that, held for one period, ends it with P w = target [kg m/s].

    guess [N m] and slope [kg/s / N m], of P w over the torque, start the search.
    """

    def miss(torque: Float[Array, ""]) -> Float[Array, ""]:
        after = after_a_period(robot, biped, torque, period, friction)
        return robot.inertia.at(after.phase).P * after.crank_rate - target

    return secant(miss, guess, slope)
