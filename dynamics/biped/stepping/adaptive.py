"""Steps of controlled size, for EventExact: Dormand and Prince's pair and its error estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.contact import EDGE_ROUNDINGS, Friction, System, torque_held
from stickslip.dynamics.biped.state import Walk, within_turn
from stickslip.dynamics.biped.stepping.stages import Beginning, Event, Samples, Taken, midpoint
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.settings import EventExact


# Dormand and Prince, J. Comp. Appl. Math. 6 (1980): the seven stages, the seventh at the end; the
# fifth-order solution minus the fourth-order one; and, as an eighth row, Shampine's fourth-order
# interpolant at the midpoint (Hairer, Norsett, Wanner, Solving ODEs I, II.6).
_ROWS = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    (
        6025192743 / 60171106304,
        0.0,
        51252292925 / 130801643196,
        -2691868925 / 90256659456,
        187940372067 / 3189068634112,
        -1776094331 / 39487288512,
        11237099 / 470086768,
    ),
)
TABLEAU = np.array([row + (0.0,) * (8 - len(row)) for row in _ROWS])
ERROR = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40, 0.0])
_END = 6


def dormand_prince_step(system: System, friction: Friction | None, mode, walk: Walk, step) -> Taken:
    """A fifth-order step with error estimates; the eight stages are one loop (see above)."""
    dtype = walk.phase.dtype
    tableau = jnp.asarray(TABLEAU, dtype)
    at_start = jnp.stack([*walk[:4], jnp.zeros_like(walk.phase)])

    def stage(slopes, index):
        theta, rate, slide, velocity, work = at_start + step * _weighted(tableau[index], slopes)
        inertia = system.model.inertia.at(theta)
        motion = system.motion(friction, mode, inertia, rate)
        power = motion.torque * rate
        slope = [rate, motion.crank_acceleration, velocity, motion.foot_acceleration, power]
        place = (theta, rate, slide, velocity, work)
        slopes = jax.lax.dynamic_update_index_in_dim(slopes, jnp.stack(slope), index, 0)
        return slopes, (place, motion, inertia)

    slopes, (places, motions, inertias) = jax.lax.scan(
        stage, jnp.zeros((len(_ROWS), len(at_start)), dtype), jnp.arange(len(_ROWS))
    )
    theta, rate, slide, velocity, work = (column[_END] for column in places)
    end, middle = (jax.tree.map(lambda row, at=at: row[at], motions) for at in (_END, _END + 1))
    inertia = jax.tree.map(lambda row: row[_END], inertias)
    errors = step * _weighted(jnp.asarray(ERROR, dtype), slopes[:, :4])
    return Taken(
        phase=theta,
        crank_rate=rate,
        foot_position=slide if friction is not None else walk.foot_position,
        foot_velocity=velocity if friction is not None else walk.foot_velocity,
        end=end,
        inertia=inertia,
        middle=midpoint(friction, middle),
        work=work if torque_held(system.drive) is None else None,
        errors=errors,
    )


def _weighted(weights: Float[Array, " stages"], slopes: Float[Array, "stages n"]):
    """Sum of the slopes by their weights; no matrix product, which would be no part of a kernel."""
    return jnp.sum(weights[:, None] * slopes, axis=0)


def next_size(spec: EventExact, system: System, walk: Walk, taken: Taken, step):
    """The next step's size by the estimated error, and whether this step fails its tolerance.

    Sizes are choices, not functions of the state: no derivative goes through them.
    """
    dtype = step.dtype
    rtol = max(spec.rtol, 32 * float(jnp.finfo(dtype).eps))
    start, end = jnp.stack(walk[:4]), jnp.stack(taken[:4])
    # what roundings of the weight make of a step: near rest nothing is known to a part of itself
    gravity = jnp.asarray(system.model.gravity, dtype)
    turn = gravity / system.model.step_length
    known = jnp.stack([turn * step**2, turn * step, gravity * step**2, gravity * step])
    rounded = EDGE_ROUNDINGS * jnp.finfo(dtype).eps * known
    allowed = spec.atol + rtol * jnp.maximum(jnp.abs(start), jnp.abs(end)) + rounded
    worst = jax.lax.stop_gradient(jnp.max(jnp.abs(taken.errors) / allowed))
    worst = jnp.where(jnp.isfinite(worst), worst, jnp.inf)
    factor = jnp.clip(0.9 * jnp.maximum(worst, 1e-10) ** -0.2, 0.2, 5.0)
    fails = (worst > 1) & (step > system.tiny())
    before = step if walk.size is None else walk.size
    kept = jax.lax.stop_gradient(jnp.maximum(before, step))  # a step cut short says little
    plain = jax.lax.stop_gradient(step)
    size = jnp.where(fails, plain * factor, jnp.where(step < before, kept, plain * factor))
    rate = jnp.where(jnp.isfinite(taken.crank_rate), taken.crank_rate, walk.crank_rate)
    return within_turn(spec, size, rate), fails


def is_noise(system: System, walk: Walk, begun: Beginning, samples: Samples, taken: Taken):
    """True if the step ends so near the onset or the stop that is aimed at that the cone's margin,
    or the foot's speed, is what roundings make of it: no aim comes nearer."""
    share = EDGE_ROUNDINGS * jnp.finfo(begun.step.dtype).eps
    edge = share * jnp.abs(taken.end.friction_force)
    speed = share * system.model.gravity * begun.step
    onset = (begun.mode == 0) & (jnp.abs(samples.cone[2]) <= edge)
    stop = (begun.mode != 0) & (jnp.abs(samples.foot_velocity[2]) <= speed)
    return ((walk.target == EventKind.SLIP) & onset) | ((walk.target == EventKind.STICK) & stop)


def controlled(
    spec: EventExact,
    system: System,
    walk: Walk,
    begun: Beginning,
    taken: Taken,
    event: Event,
    status,
):
    """Event, status and next size with the step's error looked at: one that misses the tolerance is
    repeated shorter, whatever happens in it, and may overflow."""
    step = begun.step
    size, fails = next_size(spec, system, walk, taken, step)
    kind = jnp.where(fails, EventKind.NONE, event.kind).astype(event.kind.dtype)
    time = jnp.where(fails, size / jnp.where(step > 0, step, 1.0), event.time)
    happens, reached = event.happens | fails, event.reached & ~fails
    event = event._replace(kind=kind, time=time, happens=happens, reached=reached)
    overflows = (status == Status.NON_FINITE) | (status == Status.NOT_CONVERGED)
    status = jnp.where(fails & overflows, Status.OK, status)
    status = jnp.where(begun.final, Status.NOT_CONVERGED, status).astype(jnp.int32)
    return event, status, size
