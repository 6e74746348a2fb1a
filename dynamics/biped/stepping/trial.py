"""One trial of the event-split integrators: a Runge-Kutta step in one mode, and its judgement."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import EDGE_ROUNDINGS, edge_ahead, friction_on
from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
from stickslip.dynamics.biped.stepping.stages import (
    Crossing,
    Taken,
    classical_step,
    cone_margin,
    dormand_prince_step,
    first_crossing,
    parabola_slope,
)
from stickslip.dynamics.biped.stepping.walk import (
    END,
    Ending,
    Sample,
    Walk,
    bounds,
    first_ending,
    grounds_of,
    lever_at,
    mode_at,
    slips_freely,
    status_at,
    within_turn,
)
from stickslip.dynamics.scene import Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.contact import Coefficients, Motion, System
    from stickslip.dynamics.biped.stepping.walk import Ground


class Trial(NamedTuple):
    """A Runge-Kutta step from the walk's state, and its acceptance."""

    step: Float[Array, ""]
    """Its length [s]."""
    mode: Float[Array, ""]
    phase: Float[Array, ""]
    crank_rate: Float[Array, ""]
    foot_position: Float[Array, ""]
    foot_velocity: Float[Array, ""]
    alpha: Float[Array, ""]
    """Crank acceleration at the end."""
    foot: Float[Array, ""]
    """Foot acceleration at the end."""
    alpha_middle: Float[Array, ""]
    foot_middle: Float[Array, ""]
    work: Float[Array, ""] | None
    """Work of the motor at the end [J], where its torque is not given; and its power there [W]."""
    power: Float[Array, ""] | None
    size: Float[Array, ""] | None
    """Next step of the adaptive integrator; None for fixed steps."""
    direction: Float[Array, ""]
    """Direction in which the foot would break loose at the end."""
    kind: Int[Array, ""]
    """The first event inside, if there is one."""
    ending: Int[Array, ""]
    """The status that it ends the walk with, if it does."""
    time: Float[Array, ""]
    """When, in fractions of the step."""
    accepted: Bool[Array, ""]
    """Move to the end; else aim again at `time`."""
    switches: Bool[Array, ""]
    """The end is the event (accepted then, too)."""
    final: Bool[Array, ""]
    """The last trial allowed, accepted unsplit."""
    status: Int[Array, ""]
    """Terminal if the model does not hold where the trial starts, or the step is none."""


class _Beginning(NamedTuple):
    """Mode and length of a trial."""

    step: Float[Array, ""]
    mode: Float[Array, ""]
    near: Float[Array, ""]
    """The time within which the event that is aimed at is at once [s]."""
    final: Bool[Array, ""]
    """The last trial allowed."""


class _Samples(NamedTuple):
    """Start, middle and end of a trial."""

    phase: tuple[Array, Array, Array]
    crank_rate: tuple[Array, Array, Array]
    foot_position: tuple[Array, Array, Array]
    foot_velocity: tuple[Array, Array, Array]
    cone: tuple[Array, Array, Array]
    """Margin of the static friction cone [N]."""


class _Event(NamedTuple):
    """First event of a trial, if there is one; fields as in Trial."""

    kind: Int[Array, ""]
    ending: Int[Array, ""]
    time: Float[Array, ""]
    happens: Bool[Array, ""]
    reached: Bool[Array, ""]
    """The trial's end is close enough to the event to be moved onto it."""


def attempt(spec: RK4Split | EventExact, system: System, walk: Walk) -> Trial:
    """Take one Runge-Kutta step in the walk's mode and judge it."""
    friction = friction_on(system.scene.floor, walk.patch, walk.phase.dtype)
    inertia = system.model.inertia.at(walk.phase)
    begun = _begun(spec, system, walk, friction, inertia)
    step, mode = begun.step, begun.mode
    first = system.motion(friction, mode, inertia, walk.crank_rate, walk.foot_velocity)
    if isinstance(spec, EventExact):
        taken = dormand_prince_step(system, friction, mode, walk, step)
    else:
        taken = classical_step(system, friction, mode, walk, inertia, step)
    end, middle = taken.end, taken.middle
    samples = _sampled(friction, walk, first, taken, step)
    grounds = _grounds(system, samples, (first, taken.middle, end), inertia, taken)
    ending = first_ending(system, grounds)
    event = _event(spec, system, walk, begun, first, samples, ending, taken)
    status = _status(system, walk, first, grounds[0], taken, step)
    if isinstance(spec, EventExact):
        event, status, size = _controlled(spec, system, walk, begun, taken, event, status)
        switches = event.reached
    else:
        size, switches = None, event.reached & ~begun.final | begun.final & (event.kind == END)
        switches &= event.happens
    accepted = ~event.happens | switches | begun.final
    return Trial(
        step=step,
        mode=mode,
        phase=taken.phase,
        crank_rate=taken.crank_rate,
        foot_position=taken.foot_position,
        foot_velocity=taken.foot_velocity,
        alpha=end.crank_acceleration,
        foot=end.foot_acceleration,
        alpha_middle=middle.crank_acceleration,
        foot_middle=middle.foot_acceleration,
        work=taken.work,
        power=None if taken.work is None else end.torque * taken.crank_rate,
        size=size,
        direction=-jnp.sign(end.friction_force),
        kind=event.kind,
        ending=event.ending,
        time=event.time,
        accepted=accepted,
        switches=switches,
        final=begun.final,
        status=status,
    )


def _begun(
    spec: RK4Split | EventExact, system: System, walk: Walk, friction, inertia
) -> _Beginning:
    """Mode and length of the trial that starts here."""
    final = walk.trials >= spec.trials - 1
    whole, near = walk.left <= 1.001 * walk.aim, system.tiny()
    mode = mode_at(system, friction, walk, inertia)
    if isinstance(spec, RK4Split):
        whole = whole | final  # the last trial goes to the end of the call
        # a foot that breaks loose again and again to no effect sticks
        mode = jnp.where(final & (walk.foot_velocity == 0), 0.0, mode)
        # the cone's margin is noise within some roundings of its edge
        noise = jnp.finfo(walk.left.dtype).eps ** (2 / 3) * system.duration
        near = jnp.where(walk.target == EventKind.SLIP, noise, near)
    return _Beginning(jnp.where(whole, walk.left, walk.aim), mode, near, final)


def _sampled(friction, walk: Walk, first: Motion, taken: Taken, step) -> _Samples:
    """The step's samples; in the middle, cubics through the ends' values and slopes."""

    def halfway(before, after, slope, slope_after):
        return (before, (before + after) / 2 + step / 8 * (slope - slope_after), after)

    end = taken.end
    return _Samples(
        halfway(walk.phase, taken.phase, walk.crank_rate, taken.crank_rate),
        halfway(
            walk.crank_rate, taken.crank_rate, first.crank_acceleration, end.crank_acceleration
        ),
        halfway(walk.foot_position, taken.foot_position, walk.foot_velocity, taken.foot_velocity),
        halfway(
            walk.foot_velocity, taken.foot_velocity, first.foot_acceleration, end.foot_acceleration
        ),
        (cone_margin(friction, first), taken.middle.cone_margin, cone_margin(friction, end)),
    )


def _grounds(system: System, samples: _Samples, motions, inertia: Coefficients, taken: Taken):
    """Ground forces at the three samples."""
    inertias = inertia, None, taken.inertia
    start, middle, end = map(Sample, samples.phase, samples.crank_rate, motions, inertias)
    return grounds_of(system, lever_at(system, start.phase), (start, middle, end))


def _event(
    spec: RK4Split | EventExact,
    system: System,
    walk: Walk,
    begun: _Beginning,
    first: Motion,
    samples: _Samples,
    ending: Ending,
    taken: Taken,
) -> _Event:
    """The event that is aimed at, where it is at once; else the first one inside the step."""
    kind, crossing = _first_event(spec, system, begun, walk, first, samples, ending, taken)
    at_once = (walk.target != EventKind.NONE) & (begun.step <= begun.near)
    if isinstance(spec, EventExact) and not slips_freely(system.scene):
        at_once |= _is_noise(system, walk, begun, samples, taken)
    happens = at_once | (crossing.time < jnp.inf)
    kind = jnp.where(at_once, walk.target, kind)
    time = jnp.where(happens, jnp.where(at_once, 1.0, crossing.time), 0.0)
    return _Event(kind, ending.status, time, happens, at_once | crossing.close)


def _is_noise(system: System, walk: Walk, begun: _Beginning, samples: _Samples, taken: Taken):
    """True if the step ends so near the onset or the stop that is aimed at that the cone's margin,
    or the foot's speed, is what roundings make of it: no aim comes nearer."""
    share = EDGE_ROUNDINGS * jnp.finfo(begun.step.dtype).eps
    edge = share * jnp.abs(taken.end.friction_force)
    speed = share * system.model.gravity * begun.step
    onset = (begun.mode == 0) & (jnp.abs(samples.cone[2]) <= edge)
    stop = (begun.mode != 0) & (jnp.abs(samples.foot_velocity[2]) <= speed)
    return ((walk.target == EventKind.SLIP) & onset) | ((walk.target == EventKind.STICK) & stop)


def _status(system: System, walk: Walk, first: Motion, ground: Ground, taken: Taken, step):
    """Status of the trial: the model holds at its start, and its step is valid."""
    end = taken.end
    sound = taken.phase + taken.crank_rate + taken.foot_position + taken.foot_velocity
    sound = jnp.isfinite(sound + end.crank_acceleration + end.foot_acceleration)
    return status_at(system, walk, first, ground, step, taken.phase, sound)


def _controlled(
    spec: EventExact,
    system: System,
    walk: Walk,
    begun: _Beginning,
    taken: Taken,
    event: _Event,
    status,
):
    """Event, status and next size with the step's error looked at: one that misses the tolerance is
    repeated shorter, whatever happens in it, and may overflow."""
    step = begun.step
    size, fails = _next_size(spec, system, walk, taken, step)
    kind = jnp.where(fails, EventKind.NONE, event.kind).astype(event.kind.dtype)
    time = jnp.where(fails, size / jnp.where(step > 0, step, 1.0), event.time)
    event = _Event(kind, event.ending, time, event.happens | fails, event.reached & ~fails)
    overflows = (status == Status.NON_FINITE) | (status == Status.NOT_CONVERGED)
    status = jnp.where(fails & overflows, Status.OK, status)
    status = jnp.where(begun.final, Status.NOT_CONVERGED, status).astype(jnp.int32)
    return event, status, size


def _next_size(spec: EventExact, system: System, walk: Walk, taken: Taken, step):
    """The next step's size by the estimated error, and whether this step fails its tolerance.

    Sizes are choices, not functions of the state: no derivative goes through them.
    """
    dtype = step.dtype
    rtol = max(spec.rtol, 32 * float(jnp.finfo(dtype).eps))
    before = jnp.stack([walk.phase, walk.crank_rate, walk.foot_position, walk.foot_velocity])
    after = jnp.stack([taken.phase, taken.crank_rate, taken.foot_position, taken.foot_velocity])
    if walk.size is None or taken.errors is None:
        raise TypeError("step control needs a walk and a step with an error estimate")
    # what roundings of the weight make of a step: near rest nothing is known to a part of itself
    gravity = jnp.asarray(system.model.gravity, dtype)
    turn = gravity / system.model.step_length
    known = jnp.stack([turn * step**2, turn * step, gravity * step**2, gravity * step])
    rounded = EDGE_ROUNDINGS * jnp.finfo(dtype).eps * known
    allowed = spec.atol + rtol * jnp.maximum(jnp.abs(before), jnp.abs(after)) + rounded
    worst = jax.lax.stop_gradient(jnp.max(jnp.abs(taken.errors) / allowed))
    worst = jnp.where(jnp.isfinite(worst), worst, jnp.inf)
    factor = jnp.clip(0.9 * jnp.maximum(worst, 1e-10) ** -0.2, 0.2, 5.0)
    fails = (worst > 1) & (step > system.tiny())
    kept = jax.lax.stop_gradient(jnp.maximum(walk.size, step))  # a step cut short says little
    plain = jax.lax.stop_gradient(step)
    size = jnp.where(fails, plain * factor, jnp.where(step < walk.size, kept, plain * factor))
    rate = jnp.where(jnp.isfinite(taken.crank_rate), taken.crank_rate, walk.crank_rate)
    return within_turn(spec, size, rate), fails


def _first_event(
    spec: RK4Split | EventExact,
    system: System,
    begun: _Beginning,
    walk: Walk,
    first: Motion,
    samples: _Samples,
    ending: Ending,
    taken: Taken,
):
    """Kind and crossing of the first event: exchange, end, stop or onset, edge."""
    floor, mode, step = system.scene.floor, begun.mode, begun.step
    near = spec.close, spec.reach
    rate, end = taken.crank_rate, taken.end
    last, margins = jnp.full_like(walk.target, END), ending.margins
    slope = parabola_slope(margins)
    nearer = spec.close / 10, spec.reach  # a walk ends once: another trial costs little
    ended = last, first_crossing(margins, slope, walk.target == last, *nearer, dips=True)
    low, high = bounds(walk.phase.dtype)
    exchange = jnp.full_like(walk.target, EventKind.EXCHANGE)
    room = [jnp.minimum(high - theta, theta - low) for theta in samples.phase]
    theta = samples.phase[2]
    inwards = jnp.where(high - theta < theta - low, -rate, rate)
    best = exchange, first_crossing(room, inwards * step, walk.target == exchange, *near)
    best = _earlier(ended, best)
    if slips_freely(system.scene):
        return best
    slides = mode != 0
    margins = [
        jnp.where(slides, mode * velocity, cone)
        for velocity, cone in zip(samples.foot_velocity, samples.cone, strict=True)
    ]
    slowing = mode * end.foot_acceleration * step
    slope = jnp.where(slides, slowing, parabola_slope(margins))
    change = jnp.where(slides, EventKind.STICK, EventKind.SLIP).astype(exchange.dtype)
    leaving = None
    if isinstance(spec, EventExact):
        leaving = jnp.where(slides, mode * first.foot_acceleration * step, 0.0)
    crossing = first_crossing(margins, slope, walk.target == change, *near, leaving)
    best = _earlier((change, crossing), best)
    if isinstance(floor, Patches):
        edge = edge_ahead(floor, walk.patch, mode, theta.dtype)
        edge = edge - walk.steps.astype(edge.dtype) * system.model.step_length
        ahead = slides & jnp.isfinite(edge)
        edge = jnp.where(ahead, edge, 0.0)
        gaps = [jnp.where(ahead, mode * (edge - slide), 1.0) for slide in samples.foot_position]
        kind = jnp.full_like(exchange, EventKind.PATCH)
        closing = jnp.where(ahead, -mode * samples.foot_velocity[2] * step, 0.0)
        crossing = first_crossing(gaps, closing, walk.target == kind, *near)
        best = _earlier((kind, crossing), best)
    return best


def _earlier(event: tuple[Array, Crossing], best: tuple[Array, Crossing]):
    """The earlier of two events, each a kind and a crossing."""
    (_, crossing), (_, first) = event, best
    sooner = crossing.time < first.time
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), event, best)
