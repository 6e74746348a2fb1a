"""The torque of a control period, found by looking at what comes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped import RK4Split, step
from stickslip.dynamics.scene import Scene

if TYPE_CHECKING:
    from collections.abc import Callable

    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedModel, BipedState

HOLDS = 10.0
"""A static friction coefficient that no start or stride exceeds."""
PREDICTIONS = 3
"""Of the coming period, each of which corrects the torque; the outcome is nearly linear in it."""
SMALLEST_RUN = 1e-4
"""Torques closer than this give no slope [N m]."""


def after_a_period(
    robot: BipedModel,
    biped: BipedState,
    torque: Float[Array, ""],
    period: Float[Array, ""],
    friction: ArrayLike,
) -> BipedState:
    """Predicted state after a held torque [N m], on a floor that holds a foot at rest and
    drags on a slide by this coefficient."""
    dtype = biped.crank_rate.dtype
    holds, drags = jnp.full((), HOLDS, dtype), jnp.asarray(friction, dtype)
    floor = Scene.uniform(holds, drags, outputs="state")
    return step(robot, floor, biped, torque, period, integrator=RK4Split(max_events=2))[0]


def secant(
    miss: Callable[[Float[Array, ""]], Float[Array, ""]],
    guess: Float[Array, ""],
    slope: Float[Array, ""],
) -> Float[Array, ""]:
    """The torque [N m] at which `miss` is 0, from a guess and the slope there."""

    def correct(_: int, search: tuple[Array, ...]) -> tuple[Array, ...]:
        torque, missed, run, slope = search
        now = miss(torque)
        moved = jnp.abs(run) > SMALLEST_RUN
        slope = jnp.where(moved, (now - missed) / jnp.where(moved, run, 1.0), slope)
        run = -now / slope
        return torque + run, now, run, slope

    search = guess, jnp.zeros_like(guess), jnp.zeros_like(guess), slope
    return jax.lax.fori_loop(0, PREDICTIONS, correct, search)[0]
