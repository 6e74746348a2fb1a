"""Amplification of a small difference at the start: derivatives through the walk."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.numeric import Numeric


NUDGE = 1e-4
"""Distance between the starts of two compared walks [-], in own units."""


class Sampled(Protocol):
    """A walk at n instants."""

    @property
    def angle(self) -> Float[Array, " n"]:
        """Crank angle [rad]."""
        ...

    @property
    def slide(self) -> Float[Array, " n"]:
        """Slide of the foot [m]."""
        ...


S = TypeVar("S", bound=Sampled)


def amplification(
    walk: Callable[[BipedState], S],
    state: BipedState,
    length: Numeric,
    time: Numeric,
    slips_freely: bool = False,
) -> tuple[S, Float[Array, " n"]]:
    """Result of `walk` from `state`, and the sensitivity at each of its samples [n].

    length, time: the robot's own, crank [m] and sqrt(crank / gravity) [s]. The sensitivity is the
    largest singular value of the derivative of (crank angle, slide / length) by the initial (phase,
    crank rate times time, slide / length, foot velocity times time / length): how many times the
    worst small difference at the start has grown. Forward mode, through every switch. A foot at
    rest on dry friction stays at rest however little it is pushed, so there the velocity's column
    is left out (slips_freely: it is not).
    """
    velocity = jnp.asarray(state.foot_velocity)
    pushed = slips_freely | (velocity != 0)

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


def nudged(state: BipedState, length: Numeric, time: Numeric) -> BipedState:
    """The state with phase, crank rate and the speed of a sliding foot changed by NUDGE each, in
    the robot's own units: length [m], time [s]."""
    velocity = jnp.asarray(state.foot_velocity)
    inwards = jnp.where(jnp.asarray(state.phase) > (SUPPORT_START + SUPPORT_END) / 2, -1, 1)
    return replace(
        state,
        phase=state.phase + NUDGE * inwards,
        crank_rate=state.crank_rate + NUDGE / time,
        foot_velocity=jnp.where(velocity != 0, velocity + NUDGE * length / time, velocity),
    )


def apart(one: BipedState, other: BipedState, length: Numeric) -> Float[Array, "..."]:
    """Distance of two states in crank angle and slide / length, as a multiple of NUDGE [-].

    The largest along two walks, one of which begins `nudged`, is about their amplification: a
    finite difference of one direction, where `amplification` takes derivatives in all of them.
    """
    turned = jnp.asarray(one.phase) - other.phase
    turned += np.pi * (jnp.asarray(one.steps) - other.steps).astype(turned.dtype)
    return jnp.hypot(turned, (one.foot_position - other.foot_position) / length) / NUDGE
