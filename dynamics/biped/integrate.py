"""Event-split Runge-Kutta: fixed steps that stop and start again at every switching instant.

One trial step of the classical fourth-order method is taken in the current mode. If the foot would
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

from stickslip.dynamics.biped.floor import patch_at
from stickslip.dynamics.biped.trial import Problem, RK4Split, Trial, Walk, attempt, bounds
from stickslip.dynamics.lanes import thinning_while
from stickslip.dynamics.scene import Grip, Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool

    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.state import BipedState
    from stickslip.dynamics.scene import Scene


def start(
    model: BipedModel, scene: Scene, state: BipedState, duration, spec: RK4Split, dtype
) -> Walk:
    """The running state at the beginning of a call."""
    zero, none = jnp.zeros((), dtype), jnp.zeros((), jnp.int32)
    value = partial(jnp.asarray, dtype=dtype)
    steps = jnp.asarray(state.steps, jnp.int32)
    slide, velocity = value(state.foot_position), value(state.foot_velocity)
    log = None
    if spec.record_events:
        size = spec.trials
        log = (jnp.zeros(size, dtype), jnp.zeros(size, jnp.int32), jnp.zeros(size, dtype))
    return Walk(
        theta=value(state.phase),
        rate=value(state.crank_rate),
        slide=slide,
        velocity=velocity,
        steps=steps,
        patch=patch_at(scene.floor, steps.astype(dtype) * model.step_length + slide, velocity),
        left=duration,
        aim=duration / spec.substeps,
        target=none,
        held=zero,
        status=none,
        switches=none,
        distance=zero,
        work=zero,
        positive_work=zero,
        trials=none - 1,  # the blank trial before the first is settled, too
        log=log,
    )


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def advance(spec: RK4Split, model: BipedModel, scene: Scene, walk: Walk, torque, duration) -> Walk:
    """Run a call to its end, stopping as soon as every member of a batch is done.

    Derivatives, forward and reverse, are those of the same trials with the bound as their number:
    the instants of events move with the inputs, so the jumps of the sensitivities are included.
    """
    problem = Problem(model, scene, torque, duration)
    pending = thinning_while(
        lambda _, pending: pending.going, partial(_round, spec), problem, _first(walk)
    )
    return settle(spec, problem, pending.walk, pending.trial)


@advance.defjvp
def _advance_jvp(spec, primals, tangents):
    def bounded(model, scene, walk, torque, duration):
        problem = Problem(model, scene, torque, duration)

        def body(now, _):
            after = _round(spec, problem, now)
            return jax.tree.map(lambda a, b: jnp.where(now.going, a, b), after, now), None

        pending, _ = jax.lax.scan(body, _first(walk), length=spec.trials)
        return settle(spec, problem, pending.walk, pending.trial)

    return jax.jvp(bounded, primals, tangents)


class _Pending(NamedTuple):
    """A walk and a trial that is still to be settled; going: the call does not end with it."""

    walk: Walk
    trial: Trial
    going: Bool[Array, ""]


def _round(spec: RK4Split, problem: Problem, pending: _Pending) -> _Pending:
    walk = settle(spec, problem, pending.walk, pending.trial)
    trial = attempt(spec, problem, walk)
    return _Pending(walk, trial, _going(settle(spec, problem, walk, trial)))


def _first(walk: Walk) -> _Pending:
    return _Pending(walk, _blank(walk), _going(walk))


def _going(walk: Walk):
    return (walk.left > 0) & (walk.status <= Status.SLIP_ONSET)


def _blank(walk: Walk) -> Trial:
    """The trial before the first: nothing moves when it is settled."""
    zero, none, no = (
        jnp.zeros_like(walk.theta),
        jnp.zeros_like(walk.status),
        walk.theta != walk.theta,
    )
    return Trial(
        step=zero,
        mode=zero,
        theta=walk.theta,
        rate=walk.rate,
        slide=walk.slide,
        velocity=walk.velocity,
        alpha=zero,
        foot=zero,
        alpha_middle=zero,
        foot_middle=zero,
        direction=zero,
        kind=none,
        time=zero,
        accepted=~no,
        switches=no,
        final=no,
        status=none,
    )


def settle(spec: RK4Split, problem: Problem, walk: Walk, trial: Trial) -> Walk:
    """Act on a trial's judgement: move or stay, switch or aim at what comes first."""
    longest = problem.duration / spec.substeps
    slips = (walk.velocity == 0) & (walk.held == 0) & (trial.mode != 0)
    walk = _note(walk, slips, jnp.full_like(walk.status, EventKind.SLIP))
    moved = _note(_moved(problem, walk, trial), trial.switches, trial.kind)
    switched = _switched(problem, moved, trial)
    switched = _tidy_unsplit(switched, trial)._replace(
        aim=longest, target=jnp.zeros_like(trial.kind)
    )
    again = walk._replace(
        aim=trial.time * trial.step,
        target=trial.kind,
        held=jnp.where(walk.velocity == 0, trial.mode, 0.0),
    )
    ended = walk._replace(status=trial.status)
    result = jax.tree.map(
        lambda new, old, end: jnp.where(
            trial.status > Status.SLIP_ONSET, end, jnp.where(trial.accepted, new, old)
        ),
        switched,
        again,
        ended,
    )
    return result._replace(trials=walk.trials + 1)


def _moved(problem: Problem, walk: Walk, trial: Trial) -> Walk:
    """The walk at the trial's end, corrected onto the event by a small fraction of the step."""
    part = jnp.where(trial.switches & (trial.step > 0), trial.time - 1, 0.0)
    time = part * trial.step
    theta = trial.theta + time * trial.rate + time**2 / 2 * trial.alpha
    rate = trial.rate + time * trial.alpha + time * part * (trial.alpha - trial.alpha_middle)
    slide = trial.slide + time * trial.velocity + time**2 / 2 * trial.foot
    velocity = trial.velocity + time * trial.foot + time * part * (trial.foot - trial.foot_middle)
    left = walk.left - trial.step - time
    tiny = 8 * jnp.finfo(walk.theta.dtype).eps * problem.duration
    work = jnp.where(trial.step > 0, problem.torque * (theta - walk.theta), 0.0)
    return walk._replace(
        theta=theta,
        rate=rate,
        slide=slide,
        velocity=velocity,
        left=jnp.where((left <= tiny) | trial.final, 0.0, left),
        held=jnp.zeros_like(walk.held),
        distance=walk.distance + jnp.abs(slide - walk.slide),
        work=walk.work + work,
        positive_work=walk.positive_work + jnp.maximum(work, 0.0),
    )


def _switched(problem: Problem, walk: Walk, trial: Trial) -> Walk:
    """What an event changes: velocity, direction, leg or patch."""
    model, scene = problem.model, problem.scene
    low, high = bounds(walk.theta.dtype)
    kind = jnp.where(trial.switches, trial.kind, EventKind.NONE)
    exchange = kind == EventKind.EXCHANGE
    one = scene.steps == "one"
    stops = exchange if one else exchange & ~model.symmetric
    word = Status.STEP_COMPLETE if one else Status.NO_EXCHANGE
    forwards = walk.theta > jnp.pi
    passes = exchange & ~stops
    step = jnp.where(passes, jnp.where(forwards, 1, -1), 0).astype(jnp.int32)
    walk = walk._replace(
        theta=jnp.where(passes, jnp.where(forwards, low, high), walk.theta),
        steps=walk.steps + step,
        status=jnp.where(stops, word, walk.status).astype(jnp.int32),
    )
    if isinstance(scene.floor, Grip):
        return walk
    walk = walk._replace(
        velocity=jnp.where(kind == EventKind.STICK, 0.0, walk.velocity),
        held=jnp.where(kind == EventKind.SLIP, trial.direction, 0.0),
    )
    if isinstance(scene.floor, Patches):
        place = walk.steps.astype(walk.slide.dtype) * model.step_length + walk.slide
        crossed = walk.patch + jnp.where(trial.mode > 0, 1, -1).astype(jnp.int32)
        patch = jnp.where(kind == EventKind.PATCH, crossed, walk.patch)
        landed = patch_at(scene.floor, place, walk.velocity)
        walk = walk._replace(patch=jnp.where(exchange, landed, patch))
    return walk


def _tidy_unsplit(walk: Walk, trial: Trial) -> Walk:
    """After the last trial allowed: no sliding against the mode, the phase within its bounds."""
    low, high = bounds(walk.theta.dtype)
    turned_back = trial.final & (trial.mode * walk.velocity < 0)
    turn = jnp.where(walk.theta > high, 1, jnp.where(walk.theta < low, -1, 0))
    turn = jnp.where(trial.final, turn, 0).astype(jnp.int32)
    return walk._replace(
        velocity=jnp.where(turned_back, 0.0, walk.velocity),
        theta=walk.theta - turn.astype(low.dtype) * (high - low),
        steps=walk.steps + turn,
    )


def _note(walk: Walk, happens, kind) -> Walk:
    """Count an event, and write it down where events are recorded."""
    log = walk.log
    if log is not None:
        entry = (walk.left, kind, walk.theta + jnp.pi * walk.steps.astype(walk.theta.dtype))
        place = jnp.minimum(walk.switches, log[0].shape[0] - 1)
        log = tuple(
            row.at[place].set(jnp.where(happens, new.astype(row.dtype), row[place]))
            for row, new in zip(log, entry, strict=True)
        )
    slips = happens & (kind == EventKind.SLIP)
    return walk._replace(
        switches=walk.switches + happens.astype(jnp.int32),
        status=jnp.where(slips, Status.SLIP_ONSET, walk.status).astype(jnp.int32),
        log=log,
    )
