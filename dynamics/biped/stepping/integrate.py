"""Event-split Runge-Kutta: steps that stop and start again at every switching instant.

One trial step, of fixed or of controlled length, is taken in the current mode. If the foot would
break loose, stop, cross a patch's edge or hand over to the other foot inside it, the trial is taken
again up to that instant, corrected onto it and the mode switched; else it stands. Every trial does
the same work whatever happens, so a batch runs in step without branches, and the number of trials
is bounded: the last one allowed goes to the end of the call unsplit.

The loop alternates `attempt` (trial.py: compute a trial and judge it) and `settle` (here: act on
the judgement). Judgement and action stand on either side of the loop's boundary on purpose: what
crosses it is computed once, where inside one body the compiler repeats it for every result.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import System, Torque
from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
from stickslip.dynamics.biped.stepping.trial import Trial, attempt
from stickslip.dynamics.biped.stepping.walk import END, Walk, bounds, hand_over, note, slips_freely
from stickslip.dynamics.kernels.batch_axes import jvp_in_front
from stickslip.dynamics.kernels.lanes import compacting_while
from stickslip.dynamics.scene import Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def advance(spec: RK4Split | EventExact, system: System, walk: Walk) -> Walk:
    """Run a call to its end, stopping as soon as every member of a batch is done.

    Derivatives, forward and reverse, are those of the same trials with the bound as their number:
    the instants of events move with the inputs, so the jumps of the sensitivities are included.
    """
    pending = compacting_while(
        lambda _, pending: pending.going, partial(_round, spec), system, _first(system, walk)
    )
    return settle(spec, system, pending.walk, pending.trial)


@advance.defjvp
def _advance_jvp(spec, primals, tangents):
    def bounded(system, walk):
        def body(now, _):
            again = partial(_round, spec, system)
            if isinstance(spec, RK4Split):  # few trials: a branch would keep a table a member
                return jax.tree.map(partial(jnp.where, now.going), again(now), now), None
            return jax.lax.cond(now.going, again, lambda now: now, now), None

        pending, _ = jax.lax.scan(body, _first(system, walk), length=spec.trials)
        return settle(spec, system, pending.walk, pending.trial)

    return jvp_in_front(bounded, primals, tangents)


class _Pending(NamedTuple):
    """A walk and a trial that is still to be settled; going: the call does not end with it."""

    walk: Walk
    trial: Trial
    going: Bool[Array, ""]


def _round(spec: RK4Split | EventExact, system: System, pending: _Pending) -> _Pending:
    walk = settle(spec, system, pending.walk, pending.trial)
    trial = attempt(spec, system, walk)
    return _Pending(walk, trial, _going(settle(spec, system, walk, trial)))


def _first(system: System, walk: Walk) -> _Pending:
    return _Pending(walk, _blank(system, walk), _going(walk))


def _going(walk: Walk):
    return (walk.left > 0) & (walk.status <= Status.SLIP_ONSET)


def _blank(system: System, walk: Walk) -> Trial:
    """The trial before the first: nothing moves when it is settled."""
    zero, none, no = (
        jnp.zeros_like(walk.phase),
        jnp.zeros_like(walk.status),
        walk.phase != walk.phase,
    )
    power = None if isinstance(system.drive, Torque) else zero
    return Trial(
        step=zero,
        mode=zero,
        phase=walk.phase,
        crank_rate=walk.crank_rate,
        foot_position=walk.foot_position,
        foot_velocity=walk.foot_velocity,
        alpha=zero,
        foot=zero,
        alpha_middle=zero,
        foot_middle=zero,
        work=power,
        power=power,
        size=None if walk.size is None else walk.aim,
        direction=zero,
        kind=none,
        ending=none,
        time=zero,
        accepted=~no,
        switches=no,
        final=no,
        status=none,
    )


def settle(spec: RK4Split | EventExact, system: System, walk: Walk, trial: Trial) -> Walk:
    """Act on a trial's judgement: move or stay, switch or aim at what comes first.

    A walk that has ended stays as it is, to the last bit: 0 times its rate may be no number.
    """
    fixed = isinstance(spec, RK4Split)
    longest = system.duration / spec.substeps if fixed else trial.size
    slips = (walk.foot_velocity == 0) & (walk.breakaway == 0) & (trial.mode != 0)
    walk = note(walk, slips, jnp.full_like(walk.status, EventKind.SLIP))
    ends = trial.switches & (trial.kind == END)
    moved = note(_moved(system, walk, trial), trial.switches & ~ends, trial.kind)
    switched = _switched(system, moved, trial)
    switched = _tidy_unsplit(system, switched, trial)
    status = jnp.where(ends, trial.ending, switched.status)
    switched = switched._replace(aim=longest, target=jnp.zeros_like(trial.kind), status=status)
    again = walk._replace(
        aim=trial.time * trial.step,
        target=trial.kind,
        breakaway=jnp.where(walk.foot_velocity == 0, trial.mode, 0.0),
    )
    ended = walk._replace(status=jnp.maximum(walk.status, trial.status))
    over = ended.status > Status.SLIP_ONSET
    result = jax.tree.map(
        lambda new, old, end: jnp.where(over, end, jnp.where(trial.accepted, new, old)),
        switched,
        again,
        ended,
    )
    return result._replace(trials=walk.trials + 1, size=trial.size)


def _moved(system: System, walk: Walk, trial: Trial) -> Walk:
    """The walk at the trial's end, corrected onto the event by a small fraction of the step."""
    part = jnp.where(trial.switches & (trial.step > 0), trial.time - 1, 0.0)
    time = part * trial.step
    theta = trial.phase + time * trial.crank_rate + time**2 / 2 * trial.alpha
    rate = trial.crank_rate + time * trial.alpha + time * part * (trial.alpha - trial.alpha_middle)
    slide = trial.foot_position + time * trial.foot_velocity + time**2 / 2 * trial.foot
    velocity = (
        trial.foot_velocity + time * trial.foot + time * part * (trial.foot - trial.foot_middle)
    )
    left = walk.left - trial.step - time
    tiny = 8 * jnp.finfo(walk.phase.dtype).eps * system.duration
    if isinstance(system.drive, Torque):
        work = system.drive.torque * (theta - walk.phase)
    else:  # a given crank motion: integrated along the step
        work = jnp.asarray(trial.work) + time * jnp.asarray(trial.power)
    work = jnp.where(trial.step > 0, work, 0.0)
    return walk._replace(
        phase=theta,
        crank_rate=rate,
        foot_position=slide,
        foot_velocity=velocity,
        left=jnp.where((left <= tiny) | trial.final & ~trial.switches, 0.0, left),
        breakaway=jnp.zeros_like(walk.breakaway),
        distance=walk.distance + jnp.abs(slide - walk.foot_position),
        work=walk.work + work,
        positive_work=walk.positive_work + jnp.maximum(work, 0.0),
    )


def _switched(system: System, walk: Walk, trial: Trial) -> Walk:
    """State after an event: new velocity, direction, leg or patch."""
    low, high = bounds(walk.phase.dtype)
    kind = jnp.where(trial.switches, trial.kind, EventKind.NONE)
    exchange = kind == EventKind.EXCHANGE
    bound = jnp.where(walk.phase > jnp.pi, high, low)
    if not slips_freely(system.scene):
        walk = walk._replace(
            foot_velocity=jnp.where(kind == EventKind.STICK, 0.0, walk.foot_velocity),
            breakaway=jnp.where(kind == EventKind.SLIP, trial.direction, 0.0),
        )
    if isinstance(system.scene.floor, Patches):
        crossed = walk.patch + jnp.where(trial.mode > 0, 1, -1).astype(jnp.int32)
        walk = walk._replace(patch=jnp.where(kind == EventKind.PATCH, crossed, walk.patch))
    walk = walk._replace(phase=jnp.where(exchange, bound, walk.phase))
    return hand_over(system, walk, exchange)


def _tidy_unsplit(system: System, walk: Walk, trial: Trial) -> Walk:
    """After the last trial allowed: no sliding against the mode, support and patch by the place."""
    low, high = bounds(walk.phase.dtype)
    turned_back = trial.final & (trial.mode * walk.foot_velocity < 0)
    walk = walk._replace(foot_velocity=jnp.where(turned_back, 0.0, walk.foot_velocity))
    passed = (walk.phase > high) | (walk.phase < low)
    return hand_over(system, walk, trial.final & passed, landed=trial.final)
