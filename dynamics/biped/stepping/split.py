"""Event-split Runge-Kutta: steps that stop and start again at every switching instant.

One trial step, of fixed or of controlled length, is taken in the current mode. If the foot would
break loose, stop, cross a patch's edge or hand over to the other foot inside it, the trial is
repeated up to that instant, corrected onto it and the mode switched; else it stands. Every trial
does the same work whatever happens, so a batch runs in step without branches, and the number of
trials is bounded: the last one allowed goes to the end of the call unsplit.

The loop alternates `attempt` (compute a trial and judge it) and `settle` (act on the judgement).
Judgement and action stand on either side of the loop's boundary on purpose: what crosses it is
computed once, where inside one body the compiler repeats it for every result.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Motion, System, edge_ahead, torque_held
from stickslip.dynamics.biped.settings import EventExact, RK4Split
from stickslip.dynamics.biped.state import END, Walk, bounds, hand_over, mode_at, note
from stickslip.dynamics.biped.stepping import stages
from stickslip.dynamics.biped.stepping.adaptive import controlled, dormand_prince_step, is_noise
from stickslip.dynamics.kernels.fused import compacting_while
from stickslip.dynamics.kernels.jax_interface import jvp_in_front
from stickslip.dynamics.scene import Grip, Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.dynamics.pytrees import Flag, Integer, Scalar


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
            go_on = partial(_round, spec, system)
            if isinstance(spec, RK4Split):  # few trials: a branch would keep a table a member
                return jax.tree.map(partial(jnp.where, now.going), go_on(now), now), None
            return jax.lax.cond(now.going, go_on, lambda now: now, now), None

        pending, _ = jax.lax.scan(body, _first(system, walk), length=spec.trials)
        return settle(spec, system, pending.walk, pending.trial)

    return jvp_in_front(bounded, primals, tangents)


class Trial(NamedTuple):
    """A Runge-Kutta step and its acceptance; what `settle` does not read is None."""

    begun: stages.Beginning
    taken: stages.Taken
    event: stages.Event
    """The first event inside, if there is one."""
    size: Scalar | None
    """Next step of the adaptive integrator; None for fixed steps."""
    accepted: Flag
    """Move to the end; else aim again at the event."""
    switches: Flag
    """The end is the event (accepted then, too)."""
    status: Integer
    """Terminal if the model does not hold where the trial starts, or the step is none."""
    taken_back: Scalar
    """The lesser of what the motor gives and takes [J]."""

    def kept(self, system: System) -> Any:
        """What `settle` reads."""
        unread = {"normal_force": None, "solvability": None}
        end, middle = self.taken.end._replace(**unread), self.taken.middle._replace(**unread)
        if torque_held(system.drive) is not None:
            end = end._replace(torque=None)
        middle = middle._replace(cone_margin=None)
        return self._replace(
            begun=self.begun._replace(near=None),
            taken=self.taken._replace(end=end, middle=middle, inertia=None, errors=None),
            event=self.event._replace(happens=None, reached=None),
        )


class _Pending(NamedTuple):
    """A walk and a trial that is still to be settled; going: the call does not end with it."""

    walk: Walk
    trial: Trial
    going: Flag


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
    zero, none = jnp.zeros_like(walk.phase), jnp.zeros_like(walk.status)
    no = walk.phase != walk.phase
    work = zero if torque_held(system.drive) is None else None
    begun, event = stages.Beginning(zero, zero, zero, no), stages.Event(none, none, zero, no, no)
    end, middle = Motion(*[zero] * 6), stages.Midpoint(*[zero] * 5)
    unread: Any = None
    taken = stages.Taken(*walk[:4], end, unread, middle, work, unread)
    size = None if walk.size is None else walk.aim
    return Trial(begun, taken, event, size, ~no, no, none, zero).kept(system)


def attempt(spec: RK4Split | EventExact, system: System, walk: Walk) -> Trial:
    """Take one Runge-Kutta step in the walk's mode and judge it."""
    friction = system.friction(walk.patch)
    inertia = system.model.inertia.at(walk.phase)
    begun = _begun(spec, system, walk, friction, inertia)
    step, mode = begun.step, begun.mode
    first = system.motion(friction, mode, inertia, walk.crank_rate)
    if isinstance(spec, EventExact):
        taken = dormand_prince_step(system, friction, mode, walk, step)
    else:
        taken = stages.classical_step(system, friction, mode, walk, inertia, step)
    end, middle = taken.end, taken.middle
    held = torque_held(system.drive)
    work = jnp.asarray(taken.work) if held is None else held * (taken.phase - walk.phase)
    ends = first.torque * walk.crank_rate, end.torque * taken.crank_rate
    taken_back = stages.taken_back(*ends, work, step)
    samples = _sampled(friction, walk, first, taken, step)
    levers = stages.levers_of(system, samples.phase, inertia, taken.inertia)
    motions = zip(samples.crank_rate, (first, middle, end), levers, strict=True)
    grounds = [stages.ground_of(system, *motion) for motion in motions]
    ending = stages.first_ending(system, grounds)
    event = _event(spec, system, walk, begun, first, samples, ending, taken)
    reached = *taken[:4], end.crank_acceleration, end.foot_acceleration
    status = stages.status_at(system, walk, first, grounds[0], step, reached)
    if isinstance(spec, EventExact):
        event, status, size = controlled(spec, system, walk, begun, taken, event, status)
        switches = event.reached
    else:
        size, switches = None, event.reached & ~begun.final | begun.final & (event.kind == END)
        switches &= event.happens
    accepted = ~event.happens | switches | begun.final
    judged = event, size, accepted, switches, status
    return Trial(begun, taken, *judged, taken_back).kept(system)


def _begun(
    spec: RK4Split | EventExact, system: System, walk: Walk, friction, inertia
) -> stages.Beginning:
    """Mode and length of the trial that starts here."""
    final = walk.trials >= spec.trials - 1
    spare: Any = 1e-3  # of a step, by which it is lengthened to the end of the call
    if isinstance(spec, EventExact):  # onto an event it may miss by less
        close = spec.close[str(walk.phase.dtype)]
        spare = jnp.where(walk.target == EventKind.NONE, spare, close / 100)
    whole, near = walk.left <= (1 + spare) * walk.aim, system.tiny()
    mode = mode_at(system, friction, walk, inertia)
    if isinstance(spec, RK4Split):
        whole = whole | final  # the last trial goes to the end of the call
        # a foot that breaks loose again and again to no effect sticks
        mode = jnp.where(final & (walk.foot_velocity == 0), 0.0, mode)
        # the cone's margin is noise within some roundings of its edge
        noise = jnp.finfo(walk.left.dtype).eps ** (2 / 3) * system.duration
        near = jnp.where(walk.target == EventKind.SLIP, noise, near)
    return stages.Beginning(jnp.where(whole, walk.left, walk.aim), mode, near, final)


def _sampled(friction, walk: Walk, first: Motion, taken: stages.Taken, step) -> stages.Samples:
    """The step's samples; in the middle, cubics through the ends' values and slopes."""
    end = taken.end
    slopes = walk.crank_rate, first.crank_acceleration, walk.foot_velocity, first.foot_acceleration
    later = taken.crank_rate, end.crank_acceleration, taken.foot_velocity, end.foot_acceleration
    cubics = [
        (before, (before + after) / 2 + step / 8 * (slope - slope_then), after)
        for before, after, slope, slope_then in zip(walk[:4], taken[:4], slopes, later, strict=True)
    ]
    begins, ends = (stages.cone_margin(friction, motion) for motion in (first, end))
    cone = begins, taken.middle.cone_margin, ends
    return stages.Samples(*cubics, cone)  # pyright: ignore[reportCallIssue]


def _event(
    spec: RK4Split | EventExact, system: System, walk: Walk, begun, first, samples, ending, taken
) -> stages.Event:
    """The event that is aimed at, where it is at once; else the first one inside the step."""
    kind, crossing = _first_event(spec, system, walk, begun, first, samples, ending.margins, taken)
    at_once = (walk.target != EventKind.NONE) & (begun.step <= begun.near)
    if isinstance(spec, EventExact) and not isinstance(system.scene.floor, Grip):
        at_once |= is_noise(system, walk, begun, samples, taken)
    happens = at_once | (crossing.time < jnp.inf)
    kind = jnp.where(at_once, walk.target, kind)
    time = jnp.where(happens, jnp.where(at_once, 1.0, crossing.time), 0.0)
    return stages.Event(kind, ending.status, time, happens, at_once | crossing.close)


def _first_event(
    spec: RK4Split | EventExact, system: System, walk: Walk, begun, first, samples, margins, taken
):
    """Kind and crossing of the first event: exchange, end (by its margins), stop or onset, edge."""
    floor, mode, step = system.scene.floor, begun.mode, begun.step
    close = spec.close[str(walk.phase.dtype)]
    rate, end = taken.crank_rate, taken.end
    last = jnp.full_like(walk.target, END)
    slope = stages.parabola_slope(margins)
    near, nearer = (close, spec.reach), (close / 10, spec.reach)  # a walk has one end
    ended = last, stages.first_crossing(margins, slope, walk.target == last, *nearer, dips=True)
    low, high = bounds(walk.phase.dtype)
    exchange = jnp.full_like(walk.target, EventKind.EXCHANGE)
    room = [jnp.minimum(high - theta, theta - low) for theta in samples.phase]
    theta = samples.phase[2]
    inwards = jnp.where(high - theta < theta - low, -rate, rate)
    best = exchange, stages.first_crossing(room, inwards * step, walk.target == exchange, *near)
    best = _earlier(ended, best)
    if isinstance(system.scene.floor, Grip):
        return best
    slides = mode != 0
    margins = [
        jnp.where(slides, mode * velocity, cone)
        for velocity, cone in zip(samples.foot_velocity, samples.cone, strict=True)
    ]
    slowing = mode * end.foot_acceleration * step
    slope = jnp.where(slides, slowing, stages.parabola_slope(margins))
    change = jnp.where(slides, EventKind.STICK, EventKind.SLIP).astype(exchange.dtype)
    leaving = None
    if isinstance(spec, EventExact):
        leaving = jnp.where(slides, mode * first.foot_acceleration * step, 0.0)
    crossing = stages.first_crossing(margins, slope, walk.target == change, *near, leaving)
    best = _earlier((change, crossing), best)
    if isinstance(floor, Patches):
        edge = edge_ahead(floor, walk.patch, mode, theta.dtype)
        edge = edge - walk.steps.astype(edge.dtype) * system.model.step_length
        ahead = slides & jnp.isfinite(edge)
        edge = jnp.where(ahead, edge, 0.0)
        gaps = [jnp.where(ahead, mode * (edge - slide), 1.0) for slide in samples.foot_position]
        kind = jnp.full_like(exchange, EventKind.PATCH)
        closing = jnp.where(ahead, -mode * samples.foot_velocity[2] * step, 0.0)
        crossing = stages.first_crossing(gaps, closing, walk.target == kind, *near)
        best = _earlier((kind, crossing), best)
    return best


def _earlier(event: tuple[Array, stages.Crossing], best: tuple[Array, stages.Crossing]):
    """The earlier of two events, each a kind and a crossing."""
    (_, crossing), (_, first) = event, best
    sooner = crossing.time < first.time
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), event, best)


def settle(spec: RK4Split | EventExact, system: System, walk: Walk, trial: Trial) -> Walk:
    """Act on a trial's judgement: move or stay, switch or aim at what comes first.

    A walk that has ended stays as it is, to the last bit: 0 times its rate may be no number.
    """
    longest = system.duration / spec.substeps if isinstance(spec, RK4Split) else trial.size
    slips = (walk.foot_velocity == 0) & (walk.breakaway == 0) & (trial.begun.mode != 0)
    walk = note(walk, slips, EventKind.SLIP)
    ends = trial.switches & (trial.event.kind == END)
    moved = note(_moved(system, walk, trial), trial.switches & ~ends, trial.event.kind)
    switched = _switched(system, moved, trial)
    switched = _tidy_unsplit(system, switched, trial)
    status = jnp.where(ends, trial.event.ending, switched.status)
    none = jnp.zeros_like(trial.event.kind)
    switched = switched._replace(aim=longest, target=none, status=status)
    aimed = walk._replace(
        aim=trial.event.time * trial.begun.step,
        target=trial.event.kind,
        breakaway=jnp.where(walk.foot_velocity == 0, trial.begun.mode, 0.0),
    )
    ended = walk._replace(status=jnp.maximum(walk.status, trial.status))
    over = ended.status > Status.SLIP_ONSET
    outcomes = switched, aimed, ended
    result = jax.tree.map(
        lambda new, old, end: jnp.where(over, end, jnp.where(trial.accepted, new, old)), *outcomes
    )
    return result._replace(trials=walk.trials + 1, size=trial.size)


def _moved(system: System, walk: Walk, trial: Trial) -> Walk:
    """The walk at the trial's end, corrected onto the event by a small fraction of the step."""
    step, taken, end, middle = trial.begun.step, trial.taken, trial.taken.end, trial.taken.middle
    alpha, foot = end.crank_acceleration, end.foot_acceleration
    part = jnp.where(trial.switches & (step > 0), trial.event.time - 1, 0.0)
    time = part * step
    theta = taken.phase + time * taken.crank_rate + time**2 / 2 * alpha
    rate = taken.crank_rate + time * alpha + time * part * (alpha - middle.crank_acceleration)
    slide = taken.foot_position + time * taken.foot_velocity + time**2 / 2 * foot
    velocity = taken.foot_velocity + time * foot + time * part * (foot - middle.foot_acceleration)
    left = walk.left - step - time
    if (held := torque_held(system.drive)) is not None:
        work = held * (theta - walk.phase)
    else:  # no constant torque: integrated along the step
        work = jnp.asarray(taken.work) + time * (end.torque * taken.crank_rate)
    work = jnp.where(step > 0, work, 0.0)
    given = jnp.maximum(work, 0.0) + trial.taken_back
    return walk._replace(
        phase=theta,
        crank_rate=rate,
        foot_position=slide,
        foot_velocity=velocity,
        left=jnp.where((left <= system.tiny()) | trial.begun.final & ~trial.switches, 0.0, left),
        breakaway=jnp.zeros_like(walk.breakaway),
        slide_distance=walk.slide_distance + jnp.abs(slide - walk.foot_position),
        work=walk.work + work,
        positive_work=walk.positive_work + given,
    )


def _switched(system: System, walk: Walk, trial: Trial) -> Walk:
    """State after an event: new velocity, direction, leg or patch."""
    low, high = bounds(walk.phase.dtype)
    kind = jnp.where(trial.switches, trial.event.kind, EventKind.NONE)
    exchange = kind == EventKind.EXCHANGE
    bound = jnp.where(walk.phase > jnp.pi, high, low)
    if not isinstance(system.scene.floor, Grip):
        walk = walk._replace(
            foot_velocity=jnp.where(kind == EventKind.STICK, 0.0, walk.foot_velocity),
            breakaway=jnp.where(
                kind == EventKind.SLIP, -jnp.sign(trial.taken.end.friction_force), 0.0
            ),
        )
    if isinstance(system.scene.floor, Patches):
        crossed = walk.patch + jnp.where(trial.begun.mode > 0, 1, -1).astype(jnp.int32)
        walk = walk._replace(patch=jnp.where(kind == EventKind.PATCH, crossed, walk.patch))
    walk = walk._replace(phase=jnp.where(exchange, bound, walk.phase))
    return hand_over(system, walk, exchange)


def _tidy_unsplit(system: System, walk: Walk, trial: Trial) -> Walk:
    """After the last trial allowed: no sliding against the mode, support and patch by the place."""
    low, high = bounds(walk.phase.dtype)
    turned_back = trial.begun.final & (trial.begun.mode * walk.foot_velocity < 0)
    walk = walk._replace(foot_velocity=jnp.where(turned_back, 0.0, walk.foot_velocity))
    passed = (walk.phase > high) | (walk.phase < low)
    return hand_over(system, walk, trial.begun.final & passed, landed=trial.begun.final)
