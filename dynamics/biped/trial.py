"""One trial of the event-split integrator: a Runge-Kutta step in one mode, and its judgement."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Motion, mode_of, moving, sticking
from stickslip.dynamics.biped.crossing import Crossing, first_crossing, parabola_slope
from stickslip.dynamics.biped.floor import Friction, edge_ahead, friction_on
from stickslip.dynamics.biped.kinematics import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.scene import Grip, Patches
from stickslip.dynamics.status import EventKind, Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.inertia import ReducedInertia
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.scene import Scene


@dataclass(frozen=True)
class RK4Split:
    """Settings of the integrator; static and hashable.

    substeps: Runge-Kutta steps that one call of `step` is divided into. max_events: switching
    instants located in one call, for which three trials each are allowed; beyond them the rest of
    the call is taken unsplit. record_events: report the instants in Contact.events.
    """

    substeps: int = 1
    max_events: int = 4
    record_events: bool = False

    def __post_init__(self):
        for name in ("substeps", "max_events"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise ValueError(f"{name} = {value!r}; accepted: an integer >= 1")

    @property
    def trials(self) -> int:
        """The most Runge-Kutta steps that one call can take."""
        return self.substeps + 3 * self.max_events


class Walk(NamedTuple):
    """The integrator's running state within one call."""

    theta: Float[Array, ""]
    rate: Float[Array, ""]
    slide: Float[Array, ""]
    velocity: Float[Array, ""]
    steps: Int[Array, ""]
    patch: Int[Array, ""]
    left: Float[Array, ""]
    """Time still to go; the call ends at 0 or at a terminal status."""
    aim: Float[Array, ""]
    """Length of the next trial."""
    target: Int[Array, ""]
    """Kind of event that the next trial is aimed at."""
    held: Float[Array, ""]
    """Direction of sliding that has begun at velocity zero, else 0."""
    status: Int[Array, ""]
    switches: Int[Array, ""]
    distance: Float[Array, ""]
    work: Float[Array, ""]
    positive_work: Float[Array, ""]
    trials: Int[Array, ""]
    log: tuple[Array, Array, Array] | None
    """Time left, kind and crank angle of the events so far."""


class Trial(NamedTuple):
    """A Runge-Kutta step from where the walk is, and what is to become of it."""

    step: Float[Array, ""]
    """Its length [s]."""
    mode: Float[Array, ""]
    theta: Float[Array, ""]
    rate: Float[Array, ""]
    slide: Float[Array, ""]
    velocity: Float[Array, ""]
    alpha: Float[Array, ""]
    """Crank acceleration at the end."""
    foot: Float[Array, ""]
    """Foot acceleration at the end."""
    alpha_middle: Float[Array, ""]
    foot_middle: Float[Array, ""]
    direction: Float[Array, ""]
    """Which way the foot would break loose at the end."""
    kind: Int[Array, ""]
    """The first event inside, if there is one."""
    time: Float[Array, ""]
    """When, in fractions of the step."""
    accepted: Bool[Array, ""]
    """Move to the end; else aim again at `time`."""
    switches: Bool[Array, ""]
    """The end is the event (accepted then, too)."""
    final: Bool[Array, ""]
    """The last trial allowed, accepted unsplit."""
    status: Int[Array, ""]
    """Terminal if the model does not hold where the trial starts or ends."""


class Problem(NamedTuple):
    """What stays the same during one call."""

    model: BipedModel
    scene: Scene
    torque: Array
    duration: Array


class _Samples(NamedTuple):
    """Start, middle and end of a trial."""

    theta: tuple[Array, Array, Array]
    slide: tuple[Array, Array, Array]
    velocity: tuple[Array, Array, Array]
    cone: tuple[Array, Array, Array]
    """How far inside the static friction cone [N]."""


class _Stages(NamedTuple):
    """Carried through the four stages: the current one's place and the weighted sums so far."""

    theta: Array
    rate: Array
    inertia: ReducedInertia
    sum_rate: Array
    sum_alpha: Array
    sum_foot: Array
    sum_slide: Array
    middle: tuple[Array, Array, Array]
    """Accelerations and cone margin at the midpoint: the mean of the second and third stage, whose
    errors of second order are opposite."""


def bounds(dtype):
    """Ends of the support phase in the working precision."""
    return jnp.asarray(SUPPORT_START, dtype), jnp.asarray(SUPPORT_END, dtype)


def attempt(spec: RK4Split, problem: Problem, walk: Walk) -> Trial:
    """Take one Runge-Kutta step in the walk's mode and judge it."""
    step = jnp.where(walk.left <= 1.001 * walk.aim, walk.left, walk.aim)
    friction = _friction(problem.scene, walk)
    inertia = problem.model.inertia.at(walk.theta)
    mode = _mode(problem, friction, walk, inertia)
    first = _motion(problem, friction, mode, inertia, walk.rate)
    last = _stages(problem, friction, mode, walk, inertia, step)
    end = _motion(problem, friction, mode, last.inertia, last.rate)

    velocity, slide = walk.velocity, walk.slide
    if friction is not None:
        velocity = walk.velocity + step * last.sum_foot
        slide = walk.slide + step * (walk.velocity + step * last.sum_slide)
    alpha_middle, foot_middle, cone_middle = last.middle

    def halfway(before, after, slope, slope_after):
        return (before, (before + after) / 2 + step / 8 * (slope - slope_after), after)

    samples = _Samples(
        halfway(walk.theta, last.theta, walk.rate, last.rate),
        halfway(walk.slide, slide, walk.velocity, velocity),
        halfway(walk.velocity, velocity, first.foot_acceleration, end.foot_acceleration),
        (_cone(friction, first), cone_middle, _cone(friction, end)),
    )
    kind, found = _first_event(problem, mode, walk, samples, last.rate, end, step)
    tiny = 8 * jnp.finfo(step.dtype).eps * problem.duration
    at_once = (walk.target != EventKind.NONE) & (step <= tiny)
    final = walk.trials >= spec.trials - 1
    happens = at_once | (found.time < jnp.inf)
    switches = (at_once | found.close) & happens & ~final
    sound = jnp.isfinite(last.theta + last.rate + slide + velocity + problem.torque)
    return Trial(
        step=step,
        mode=mode,
        theta=last.theta,
        rate=last.rate,
        slide=slide,
        velocity=velocity,
        alpha=end.crank_acceleration,
        foot=end.foot_acceleration,
        alpha_middle=alpha_middle,
        foot_middle=foot_middle,
        direction=-jnp.sign(end.friction_force),
        kind=jnp.where(at_once, walk.target, kind),
        time=jnp.where(happens, jnp.where(at_once, 1.0, found.time), 0.0),
        accepted=~happens | switches | final,
        switches=switches,
        final=final,
        status=_status(problem, walk, first, step, sound),
    )


def _friction(scene: Scene, walk: Walk) -> Friction | None:
    if isinstance(scene.floor, Grip):
        return None
    return friction_on(scene.floor, walk.patch, walk.theta.dtype)


def _mode(problem: Problem, friction: Friction | None, walk: Walk, inertia: ReducedInertia):
    """The mode that a trial is taken in."""
    if friction is None:
        return jnp.zeros_like(walk.theta)
    still = sticking(problem.model, inertia, walk.rate, problem.torque)
    mode = mode_of(still, walk.velocity, friction.mu_static)
    return jnp.where(walk.held != 0, walk.held, mode)


def _motion(problem: Problem, friction: Friction | None, mode, inertia, rate) -> Motion:
    if friction is None:
        return sticking(problem.model, inertia, rate, problem.torque)
    return moving(problem.model, inertia, rate, problem.torque, mode, friction.mu_kinetic)


def _cone(friction: Friction | None, motion: Motion):
    if friction is None:
        return jnp.ones_like(motion.normal_force)
    return friction.mu_static * motion.normal_force - jnp.abs(motion.friction_force)


def _stages(
    problem: Problem, friction: Friction | None, mode, walk: Walk, inertia, step
) -> _Stages:
    """The classical Runge-Kutta stages, as a loop so that the inertia is compiled once."""
    dtype = walk.theta.dtype
    shares = jnp.asarray([0.5, 0.5, 1.0, 1.0], dtype)
    weights = jnp.asarray([1 / 6, 1 / 3, 1 / 3, 1 / 6], dtype)
    slide_weights = jnp.asarray([1 / 6, 1 / 6, 1 / 6, 0.0], dtype)

    def body(index, now: _Stages) -> _Stages:
        motion = _motion(problem, friction, mode, now.inertia, now.rate)
        alpha, foot = motion.crank_acceleration, motion.foot_acceleration
        sum_rate = now.sum_rate + weights[index] * now.rate
        sum_alpha = now.sum_alpha + weights[index] * alpha
        last = index == 3
        theta = walk.theta + step * jnp.where(last, sum_rate, shares[index] * now.rate)
        rate = walk.rate + step * jnp.where(last, sum_alpha, shares[index] * alpha)
        halfway = (index == 1) | (index == 2)
        now_here = (alpha, foot, _cone(friction, motion))
        return _Stages(
            theta=theta,
            rate=rate,
            inertia=problem.model.inertia.at(theta),
            sum_rate=sum_rate,
            sum_alpha=sum_alpha,
            sum_foot=now.sum_foot + weights[index] * foot,
            sum_slide=now.sum_slide + slide_weights[index] * foot,
            middle=jax.tree.map(
                lambda new, old: old + jnp.where(halfway, new / 2, 0.0), now_here, now.middle
            ),
        )

    zero = jnp.zeros_like(walk.theta)
    begin = _Stages(walk.theta, walk.rate, inertia, zero, zero, zero, zero, (zero, zero, zero))
    return jax.lax.fori_loop(0, 4, body, begin)


def _first_event(problem: Problem, mode, walk: Walk, samples: _Samples, rate, end: Motion, step):
    """Kind and crossing of whatever comes first: exchange, stop or onset, patch's edge."""
    floor = problem.scene.floor
    low, high = bounds(walk.theta.dtype)
    exchange = jnp.full_like(walk.target, EventKind.EXCHANGE)
    room = [jnp.minimum(high - theta, theta - low) for theta in samples.theta]
    theta = samples.theta[2]
    inwards = jnp.where(high - theta < theta - low, -rate, rate)
    best = exchange, first_crossing(room, inwards * step, walk.target == exchange)
    if isinstance(floor, Grip):
        return best
    slides = mode != 0
    margins = [
        jnp.where(slides, mode * velocity, cone)
        for velocity, cone in zip(samples.velocity, samples.cone, strict=True)
    ]
    slowing = mode * end.foot_acceleration * step
    slope = jnp.where(slides, slowing, parabola_slope(margins))
    change = jnp.where(slides, EventKind.STICK, EventKind.SLIP).astype(exchange.dtype)
    found = first_crossing(margins, slope, walk.target == change)
    best = _earlier((change, found), best)
    if isinstance(floor, Patches):
        edge = edge_ahead(floor, walk.patch, mode, theta.dtype)
        edge = edge - walk.steps.astype(edge.dtype) * problem.model.step_length
        ahead = slides & jnp.isfinite(edge)
        edge = jnp.where(ahead, edge, 0.0)
        gaps = [jnp.where(ahead, mode * (edge - slide), 1.0) for slide in samples.slide]
        kind = jnp.full_like(exchange, EventKind.PATCH)
        closing = jnp.where(ahead, -mode * samples.velocity[2] * step, 0.0)
        best = _earlier((kind, first_crossing(gaps, closing, walk.target == kind)), best)
    return best


def _earlier(one: tuple[Array, Crossing], other: tuple[Array, Crossing]):
    sooner = one[1].time < other[1].time
    return jax.tree.map(lambda a, b: jnp.where(sooner, a, b), one, other)


def _status(problem: Problem, walk: Walk, first: Motion, step, sound) -> Int[Array, ""]:
    """Whether the model holds where the trial starts, and its numbers are numbers."""
    status = jnp.zeros_like(walk.status)
    status = jnp.where(jnp.abs(walk.rate) * step > jnp.pi / 2, Status.RUNAWAY, status)
    status = jnp.where(first.normal_force <= 0, Status.LIFT_OFF, status)
    status = jnp.where(first.solvable & problem.model.closes, status, Status.NO_SOLUTION)
    return jnp.where(sound, status, Status.NON_FINITE).astype(jnp.int32)
