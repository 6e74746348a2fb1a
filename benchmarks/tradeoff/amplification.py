"""Amplification of a walk by derivatives, of which the measured sample keeps a bound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from stickslip.dynamics.biped import BipedState
from stickslip.dynamics.pytrees import Numeric


def amplification(
    walk: Callable[[BipedState], Any],
    state: BipedState,
    length: Numeric,
    time: Numeric,
) -> tuple[Any, Float[Array, " n"]]:
    """Result of `walk` from `state`, and the sensitivity at each of its samples [n].

    walk: gives a tuple with the crank's `angle` [rad] and the foot's `slide` [m] at n instants.
    length, time: the robot's own, crank [m] and sqrt(crank / gravity) [s]. The sensitivity is the
    largest singular value of the derivative of (crank angle, slide / length) by the initial (phase,
    crank rate times time, slide / length, foot velocity times time / length): how many times the
    worst small difference at the start has grown. Forward mode, through every switch. A foot at
    rest on dry friction stays at rest however little it is pushed, so there the velocity's column
    is left out.
    """
    velocity = jnp.asarray(state.foot_velocity)
    pushed = velocity != 0

    def shifted(by: Float[Array, " 4"]):
        start = replace(
            state,
            phase=state.phase + by[0],
            crank_rate=state.crank_rate + by[1] / time,
            foot_position=state.foot_position + by[2] * length,
            foot_velocity=jnp.where(pushed, velocity + by[3] * length / time, velocity),
        )
        path = walk(start)
        return (path.angle, path.slide / length), path

    nowhere = jnp.zeros(4, velocity.dtype)

    def along(direction: Float[Array, " 4"]):
        _, tangents, path = jax.jvp(shifted, (nowhere,), (direction,), has_aux=True)
        return tangents, path

    directions = jnp.eye(4, dtype=nowhere.dtype)
    (angle, slide), path = jax.vmap(along, out_axes=(0, None))(directions)
    one, other, both = (
        jnp.sum(x * y, axis=0) for x, y in ((angle, angle), (slide, slide), (angle, slide))
    )
    largest = (one + other) / 2 + jnp.hypot((one - other) / 2, both)  # of J J', two by two
    return path, jnp.sqrt(largest)
