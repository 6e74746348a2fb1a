"""The torques under which the foot neither slips nor leaves the floor over a control period."""

from __future__ import annotations

from functools import partial, reduce
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import pytrees
from stickslip.dynamics.biped.contact import LIFTED, Friction, ankle_moment, moving, sticking
from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START
from stickslip.dynamics.biped.model import BipedModel, prepare
from stickslip.dynamics.biped.state import BipedState
from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Real

    from stickslip.dynamics.biped.contact import Coefficients, Motion
    from stickslip.dynamics.biped.inertia import GroundMoment
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.biped.settings import Fidelity
    from stickslip.dynamics.pytrees import Integer, Scalar

    Parts = tuple[Scalar, Scalar, Scalar]
    Limits = tuple[tuple[Scalar, ...], tuple[Scalar, ...]]
    """Numbers >= 0 of a safe motion: normal force and both edges of the foot; both of the cone."""

INTERVALS = 3
"""Equal intervals of each of a period's three parts; limits are computed at their ends."""
SLACK = 0.1
"""Share by which the reach is taken larger than at a constant acceleration."""
SPACING, BEND = 1 / 30, 0.01
"""Distance of two angles [rad] beyond which the margin grows by BEND ((distance / SPACING)^2 - 1),
for what the parabolas through neighbours leave out."""
LONGEST = 2.0
"""Greatest reach of a control period either way [rad], over which no torque is safe."""


class SafeTorque(NamedTuple):
    """A torque near the one asked for, and the interval of those without slip or fall [N m]."""

    torque: Scalar
    """Nearest torque of the interval; where it is empty, the one that violates its limits least."""
    low: Scalar
    high: Scalar
    """Below `low` where the interval is empty."""
    status: Integer
    """OK; SLIP_ONSET: the foot slides, or the friction cone leaves no torque; TOPPLE: the foot's
    edges, the normal force and the motor leave none; NON_FINITE."""


def safe_torque(
    params: BipedParams | BipedModel,
    state: BipedState,
    torque: Real[pytrees.Number, ""],
    mu_static: Real[pytrees.Number, ""],
    margin: Real[pytrees.Number, ""] = 0.02,
    *,
    duration: Real[pytrees.Number, ""] = 0.02,
    torque_limit: Real[pytrees.Number, ""] = np.inf,
    mu_kinetic: Real[pytrees.Number, ""] | None = None,
    mu_next: Real[pytrees.Number, ""] | None = None,
    fidelity: Fidelity = "reduced",
) -> SafeTorque:
    """Nearest torque [N m] that keeps the foot at rest and flat on the floor for `duration` [s].

    Without slip a constant torque T does the work T (theta - theta0), so the squared crank rate at
    any angle ahead is linear in T, and with it f, N and the ground's moment (MODEL 1.4, eqs. 30
    to 32). At 12 angles of the period's reach, on either side of an exchange of support, T keeps
    |f| <= (1 - margin) mu_static N, N >= margin m g and the zero-moment point within (1 - margin)
    of heel and toe, and so does the parabola through any three neighbours between them. What is
    left of the bend grows with their distance: beyond 1/30 rad the margin grows with its square, by
    0.01 at first, and over 2 rad no torque is safe.
    mu_next: friction [-] where the other foot lands, by default the same.

    Where the foot slides, or the cone leaves no torque, the interval's other limits hold: the
    nearest torque to the one asked for, or to the middle of the cone's limits. `low` and `high` of
    a sliding foot are of its present instant. mu_kinetic: by default mu_static. Scalars: batch
    with vmap. Pass a model from `prepare` when calling often. Never raises inside a trace.
    Neglected: the other foot, a runaway, periods after this one: a floor of little friction may
    leave no torque at a rate that was safe before.
    """
    require_kind("state", state, BipedState, "a BipedState")
    require_number("mu_static", mu_static, low=0.0, accepted="a finite friction >= 0")
    require_number("margin", margin, low=0.0, high=1.0, accepted="a share from 0 to 1")
    require_number("duration", duration, low=0.0, strict=True, accepted="a finite time > 0 [s]")
    pytrees.require_numeric(torque=torque, torque_limit=torque_limit, **vars(state))
    model = prepare(params, fidelity=fidelity)
    dtype = pytrees.float_type(model, state, torque, mu_static)
    numbers = (jnp.asarray(value, dtype) for value in (torque, margin, duration, torque_limit))
    mu = [jnp.asarray(mu_static if one is None else one, dtype) for one in (mu_kinetic, mu_next)]
    friction = Friction(jnp.asarray(mu_static, dtype), mu[0])
    return _nearest_safe(model, state.astype(dtype), *numbers, friction, mu[1])


def nearest_safe(
    model: BipedModel,
    state: BipedState,
    torque: Scalar,
    margin: Scalar,
    duration: Scalar,
    torque_limit: Scalar,
    mu: Friction,
    mu_next: Scalar,
) -> SafeTorque:
    """`safe_torque` of arrays of one type, for use inside a trace; mu: where the foot stands."""
    slides, motor = state.foot_velocity != 0, Interval(-torque_limit, torque_limit)
    sliding = _while_sliding(model, state, margin, mu)
    resting = _while_resting(model, state, margin, duration, motor, mu.mu_static, mu_next)
    flat = both(motor, jax.tree.map(partial(jnp.where, slides), sliding.flat, resting.flat))
    cone = resting.cone
    held = both(flat, cone)
    empty = held.low > held.high
    wanted = jnp.where(empty & ~slides, (cone.low + cone.high) / 2, torque)
    kept = jax.tree.map(partial(jnp.where, slides | empty), flat, held)
    chosen = jnp.clip(wanted, kept.low, kept.high)
    falls = flat.low > flat.high
    chosen = jnp.where(falls, jnp.clip((flat.low + flat.high) / 2, motor.low, motor.high), chosen)
    status = jnp.where(slides | empty, Status.SLIP_ONSET, Status.OK)
    status = jnp.where(falls, Status.TOPPLE, status)
    sound = pytrees.all_finite((state, torque, chosen))
    status = jnp.where(sound, status, Status.NON_FINITE).astype(jnp.int32)
    found = jax.tree.map(partial(jnp.where, slides), flat, held)
    return SafeTorque(jnp.where(sound, chosen, 0.0), found.low, found.high, status)


_nearest_safe = jax.jit(fused(nearest_safe))


class Interval(NamedTuple):
    """Torques [N m] that keep some limits."""

    low: Scalar
    high: Scalar


def both(one: Interval, other: Interval) -> Interval:
    """The torques that both allow."""
    return Interval(jnp.maximum(one.low, other.low), jnp.minimum(one.high, other.high))


class Safe(NamedTuple):
    """Torques that keep normal force and zero-moment point, and those of the friction cone."""

    flat: Interval
    cone: Interval


def _limits(
    model: BipedModel, motion: Motion, arm: GroundMoment, square: Scalar, mu: Scalar, margin: Scalar
) -> Limits:
    """square: of the crank rate [rad^2/s^2]."""
    alpha, a1, friction, normal = motion[:4]
    moment = ankle_moment(model, arm, square, alpha, a1)
    kept = 1 - margin
    lifted = normal - jnp.maximum(margin, LIFTED) * model.total_mass * model.gravity
    toe, heel = kept * model.toe * normal - moment, kept * model.heel * normal + moment
    cone = kept * mu * normal
    return (lifted, toe, heel), (cone - friction, cone + friction)


def _safe(idle: Limits, driven: Limits) -> Safe:
    """Torques within limits that are linear in them, from those at 0 and 1 N m."""
    groups = []
    for group in zip(idle, driven, strict=True):
        within = [Interval(*pytrees.where_positive(a, b - a)) for a, b in zip(*group, strict=True)]
        groups.append(reduce(both, within))
    return Safe(*groups)


def _while_sliding(model: BipedModel, state: BipedState, margin: Scalar, mu: Friction) -> Safe:
    """Torques that are safe at this instant of a slide."""
    theta, rate = state.phase, state.crank_rate
    inertia, lever = model.inertia.at(theta), model.inertia.moment_at(theta)
    mode = jnp.sign(state.foot_velocity)

    def at(torque: float) -> Limits:
        motion = moving(model, inertia, rate, jnp.full_like(rate, torque), mode, mu.mu_kinetic)
        return _limits(model, motion, lever, rate**2, mu.mu_static, margin)

    return _safe(at(0.0), at(1.0))


class _Node(NamedTuple):
    """A crank angle ahead of a foot at rest."""

    inertia: Coefficients
    lever: GroundMoment
    turned: Scalar
    """From the start [rad]."""
    lifted: Scalar
    """Potential energy gained since the start [J]."""


def _at_node(
    model: BipedModel, node: _Node, energy: Scalar, mu: Scalar, margin: Scalar
) -> tuple[Limits, Limits]:
    """Limits at a node under 0 and 1 N m since the start; energy: M w^2 at the start [J]."""

    def at(torque: float) -> Limits:
        square = (energy + 2 * (torque * node.turned - node.lifted)) / node.inertia.M
        motion = sticking(model, node.inertia, square, jnp.full_like(square, torque))
        return _limits(model, motion, node.lever, square, mu, margin)

    return at(0.0), at(1.0)


def _while_resting(
    model: BipedModel,
    state: BipedState,
    margin: Scalar,
    duration: Scalar,
    motor: Interval,
    mu: Scalar,
    mu_next: Scalar,
) -> Safe:
    """Torques that keep normal force, foot and cone over the reach of `duration`."""
    theta, rate = state.phase, state.crank_rate
    inertia, zero = model.inertia.at(theta), jnp.zeros_like(theta)
    energy = inertia.M * rate**2
    start = _Node(inertia, model.inertia.moment_at(theta), zero, zero)
    first = _at_node(model, start, energy, mu, margin)
    now = _safe(*first)
    low, high = reduce(both, now, motor)
    ends = (sticking(model, inertia, rate**2, one).crank_acceleration for one in (low, high))
    slowest, fastest = (duration**2 * one / 2 for one in ends)  # what brakes now may not go on so
    backwards = jnp.minimum(rate * duration + reduce(jnp.minimum, (slowest, fastest, 0.0)), 0.0)
    forwards = jnp.maximum(rate * duration + reduce(jnp.maximum, (slowest, fastest, 0.0)), 0.0)
    reach = (jnp.clip((1 + SLACK) * one, -LONGEST, LONGEST) for one in (backwards, forwards))
    parts = other, inner, outer = _parts(theta, *reach)
    longest = reduce(jnp.maximum, map(jnp.abs, (other, inner, outer - inner)))
    margin = margin + BEND * jnp.maximum((longest / INTERVALS / SPACING) ** 2 - 1, 0.0)

    def visit(k: Integer, carry: tuple[Safe, _Node, Any]) -> tuple[Safe, _Node, Any]:
        safe, last, (before, earlier) = carry
        part, number = k // (INTERVALS + 1), k % (INTERVALS + 1)
        share = (number / INTERVALS).astype(theta.dtype)
        node, exchanged = _node(model, theta, parts, part, share, last)
        here = _at_node(model, node, energy, jnp.where(exchanged, mu_next, mu), margin)
        bend = jax.tree.map(lambda a, b, c: a - 2 * b + c, here, before, earlier)
        for one, other in ((here, before), (before, earlier)):  # the parabola's control points
            between = jax.tree.map(lambda a, b, d: (a + b) / 2 - d / 4, one, other, bend)
            between = jax.tree.map(partial(jnp.where, number >= 2), between, here)
            safe = Safe(*map(both, safe, _safe(*between)))
        return Safe(*map(both, safe, _safe(*here))), node, (here, before)

    return jax.lax.fori_loop(0, 3 * (INTERVALS + 1), visit, (now, start, (first, first)))[0]


def _parts(theta: Scalar, backwards: Scalar, forwards: Scalar) -> Parts:
    """The reach in three parts, from the start [rad]: 0 to other; 0 to inner; inner to outer.

    The last two are the longer side; an exchange of support on it is at `inner`.
    """
    forth = forwards >= -backwards
    outer = jnp.where(forth, forwards, backwards)
    exchange = jnp.where(forth, SUPPORT_END, SUPPORT_START) - theta
    crosses = (jnp.abs(exchange) < jnp.abs(outer)) & (exchange * outer >= 0)
    other = jnp.where(forth, backwards, forwards)
    return other, jnp.where(crosses, exchange, outer / 2), outer


def _node(
    model: BipedModel, theta: Scalar, parts: Parts, part: Integer, share: Scalar, last: _Node
) -> tuple[_Node, Scalar]:
    """The node at a share of a part, after the `last` one; whether the other foot stands there."""
    (other, inner, outer), second = parts, part == 2
    origin = jnp.where(second, inner, 0.0)
    end = jnp.where(part == 0, other, jnp.where(second, outer, inner))
    turned = origin + (end - origin) * share
    side = theta + jnp.where(part == 0, turned, (origin + end) / 2)
    later, sooner = side > SUPPORT_END, side < SUPPORT_START
    turn = jnp.where(later, 1.0, 0.0) - jnp.where(sooner, 1.0, 0.0)
    phase = theta + turned - (SUPPORT_END - SUPPORT_START) * turn
    inertia, lever = model.inertia.at(phase), model.inertia.moment_at(phase)
    size, before = turned - last.turned, last.inertia
    gained = size / 2 * (before.Y + inertia.Y) + size**2 / 12 * (before.dY - inertia.dY)
    lifted = last.lifted + model.gravity * gained
    first = share == 0
    lifted = jnp.where(first, jnp.where(second, last.lifted, 0.0), lifted)
    return _Node(inertia, lever, turned, lifted), later | sooner
