"""The forces that hold the UGV still: eqs. (40)-(43) reduced to two unknowns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.checks import as_number, require_number
from stickslip.dynamics.pytrees import Lists, Number, where_positive
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv.poses import Pose, poses_at, require_place, stand
from stickslip.dynamics.ugv.wheel import NEWTON, PoseSolver, WheelContact, cross, dot

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int, Real

    from stickslip.dynamics.ugv.ground.shapes import Points, Values
    from stickslip.dynamics.ugv.params import UGVParams
    from stickslip.dynamics.ugv.track import Track


class Forces(NamedTuple):
    """Ground forces on the wheels [N]: F along the ground forwards, N out of it."""

    F_rear: Float[Array, "..."]
    N_rear: Float[Array, "..."]
    F_front: Float[Array, "..."]
    N_front: Float[Array, "..."]


class Equilibrium(NamedTuple):
    """Forces [N], wheel torque and leg torques [N m], margins [N] and the pose they belong to."""

    F_rear: Float[Array, "..."]
    N_rear: Float[Array, "..."]
    F_front: Float[Array, "..."]
    N_front: Float[Array, "..."]
    torque: Float[Array, "..."]
    """M on each wheel, or of each [..., 2]; anticlockwise positive, so driving forwards is < 0."""
    grip_rear: Float[Array, "..."]
    """Friction left at the rear wheel, mu N - |F|; negative: it slips."""
    grip_front: Float[Array, "..."]
    leg_torques: Float[Array, "... 2"]
    """Torque of the leg actuators, rear and front [N m]; positive drives the leg outwards."""
    clearance: Float[Array, "..."]
    """The pose's, of body and legs above the ground [m]."""
    wheel_clearance: Float[Array, "..."]
    """The pose's, between the wheels [m]."""
    status: Int[Array, "..."]
    """The pose's, or NO_SOLUTION, OVERLAP, ROLLOVER, GROUNDED, WHEEL_SLIP."""
    pose: Pose

    @property
    def forces(self) -> Forces:
        """The four ground forces."""
        return Forces(self.F_rear, self.N_rear, self.F_front, self.N_front)


def equilibrium(
    params: UGVParams,
    track: Track | str,
    x_front: Real[Number, "..."] | Lists,
    leg_angles: Real[Number, "... 2"] | Lists,
    friction: Real[Number, "..."] | Lists = 0.8,
    *,
    solver: PoseSolver = NEWTON,
) -> Equilibrium:
    """Forces and torques that hold the vehicle still, both wheels with the same torque (eq. 43).

    x_front: where the front wheel touches, [...] [m]. leg_angles: [..., 2], rear and front [rad].
    track: a Track, or one of TRACKS by its name. friction: mu between wheels and ground [-], where
    the track has a surface times its factor under each wheel. solver: see PoseSolver.

    Raises ValueError for bad numbers before tracing. Neglected: inertia and losses in the legs.
    Differentiable in every number.
    """
    mu = as_number("friction", friction, low=0.0, accepted="numbers >= 0")
    placing = require_place(params, track, x_front, leg_angles, solver, friction=mu)
    return poses_at(_held, (solver,), params, *placing, mu)


def _held(solver: PoseSolver, params: UGVParams, track: Track, *given: Array) -> Equilibrium:
    *place, friction = given
    placed = stand(params, track, *place, solver=solver)
    forces = balance(params, placed, friction_under(track, placed, friction))
    return forces._replace(pose=forces.pose.in_world())


def friction_under(
    track: Track, placed: Pose, friction: Real[Array, "..."] | float
) -> Real[Array, "..."] | float | tuple[Array, Array]:
    """mu under the rear and under the front wheel of a pose, best one of `stand` [-].

    friction: mu where the factor of the track's surface is 1 (see Surface.mu). It is returned as
    it is where the ground has no surface of its own.
    """
    if track.surface is None:
        return friction
    wheels = (placed.origin[..., 0] + wheel.x for wheel in (placed.rear, placed.front))
    rear, front = (jnp.asarray(track.surface.mu(friction, track.surface.at(x))) for x in wheels)
    return rear, front


def balance(
    params: UGVParams,
    placed: Pose,
    friction: Real[Array, "..."] | float | tuple[Array, Array],
    difference: Real[Array, "..."] | None = None,
) -> Equilibrium:
    """`equilibrium` of a pose, without checks, for use inside a trace.

    friction: mu, of both wheels or of the rear and the front one (see friction_under). difference:
    of the wheels' torques over r [N] (see ground_forces); None: none, and one torque for both.
    """
    mu_rear, mu_front = friction if isinstance(friction, tuple) else (friction, friction)
    forces = ground_forces(params, placed, 0.0 if difference is None else difference)
    along, c = forces.F_rear, params.rolling_resistance
    along = along if c is None else along + c * forces.N_rear  # what a wheel's motor makes
    torque = -along * params.wheel_radius
    if difference is not None:
        torque = jnp.stack([torque, torque - params.wheel_radius * difference], -1)
    grip_rear = mu_rear * forces.N_rear - jnp.abs(forces.F_rear)
    grip_front = mu_front * forces.N_front - jnp.abs(forces.F_front)
    legs_hold = leg_torques(params, placed, forces)
    sound = jnp.isfinite(grip_rear + grip_front + legs_hold.sum(-1))
    status = placed.status
    for bad, what in (
        (~jnp.isfinite(sum(forces)), Status.NO_SOLUTION),
        (placed.wheel_clearance < 0, Status.OVERLAP),
        (jnp.minimum(forces.N_rear, forces.N_front) <= 0, Status.ROLLOVER),
        (placed.clearance <= 0, Status.GROUNDED),
        (jnp.minimum(grip_rear, grip_front) < 0, Status.WHEEL_SLIP),
        (~sound | jnp.isnan(placed.clearance), Status.NON_FINITE),
    ):
        status = jnp.where((status == Status.OK) & bad, what, status)
    return Equilibrium(
        *forces,
        torque=torque,
        grip_rear=grip_rear,
        grip_front=grip_front,
        leg_torques=legs_hold,
        clearance=placed.clearance,
        wheel_clearance=placed.wheel_clearance,
        status=status.astype(jnp.int32),
        pose=placed,
    )


def ground_forces(
    params: UGVParams, placed: Pose, difference: Real[Array, "..."] | float = 0.0
) -> Forces:
    """The forces with M_rear - M_front = r difference [N] (eq. 42; 0: the same torque M at each).

    With a motor at each wheel the three equations of the whole vehicle leave one force free; this
    is that family, linear in `difference`. The ground resists rolling forwards by the moment c N r
    on each wheel, anticlockwise as a positive M, so the wheel's own equation is

        M + r (F + c N) = 0

    and moments of the whole vehicle gain c r (N_r + N_f). Moments about the rear contact and forces
    along the ground there, N_r = W cos b_r - F sin D - N cos D put in, leave two equations in
    F = F_front and N = N_front:

        F (1 + cos D + c sin D) - N (sin D - c (1 + cos D)) = W (sin b_r + c cos b_r) + difference
        F (d x t_f - c r sin D) + N (d x n_f + c r (1 - cos D)) = G - c r W cos b_r

    D = b_f - b_r, d from rear to front contact, G the weights' moment about the rear contact, c
    the rolling resistance, 0 where it is None.
    """
    rear, front = placed.rear, placed.front
    W, between = params.weight, front.point - rear.point
    turned = dot(rear.tangent, front.tangent), cross(rear.tangent, front.tangent)
    levers = cross(between, front.tangent), dot(between, front.tangent)
    G = weight_moment(params, placed, rear.point[..., 0])
    weight = W * rear.tangent[..., 1] + difference, W * rear.tangent[..., 0]
    F_front, N_front, N_rear = solved(params, weight, turned, levers, G)
    F_rear = F_front - difference
    if (c := params.rolling_resistance) is not None:
        F_rear += c * (N_front - N_rear)
    return Forces(F_rear, N_rear, F_front, N_front)


def solved(
    params: UGVParams, weight: tuple[Any, Any], turn: tuple[Any, Any], arms: tuple[Any, Any], G: Any
) -> tuple[Any, Any, Any]:
    """F_front, N_front and N_rear by `ground_forces`' equations, for anything with +, -, * and /.

    weight: along the ground at the rear contact, and across it [N]. turn: cos D and sin D. arms:
    d x t_f and d x n_f [m].
    """
    (along, across), (cos, sin), (lever_F, lever_N) = weight, turn, arms
    of_F, of_N = cos + 1.0, sin
    if (c := params.rolling_resistance) is not None:
        r = params.wheel_radius
        of_F, of_N = of_F + sin * c, sin - of_F * c
        lever_F, lever_N = lever_F - sin * c * r, lever_N + (-cos + 1.0) * c * r
        along, G = along + across * c, G - across * c * r
    det = of_F * lever_N + of_N * lever_F
    F, N = (along * lever_N + of_N * G) / det, (of_F * G - along * lever_F) / det
    return F, N, across - F * sin - N * cos


def split_family(params: UGVParams, placed: Pose) -> tuple[Forces, Forces]:
    """Ground forces in weights, and what each weight of `difference` adds to them [-]."""
    W = params.weight
    equal, shifted = (jnp.stack(ground_forces(params, placed, of)) / W for of in (0.0, W))
    return Forces(*equal), Forces(*(shifted - equal))


class SafeSplit(NamedTuple):
    """Differences of the wheels' torques over the radius, (M_rear - M_front) / r [N]."""

    difference: Float[Array, "..."]
    """The nearest to 0 in the interval; where that is empty, the one of least friction use."""
    low: Float[Array, "..."]
    high: Float[Array, "..."]
    """Below `low` where the interval is empty."""
    friction_use: Float[Array, "..."]
    """Least of the larger (|F| + min_grip) / (mu N) in max_torque; infinite: a wheel lifts."""
    status: Int[Array, "..."]
    """The pose's, or where the interval is empty ROLLOVER (a wheel always lifts) or WHEEL_SLIP."""


def safe_split(
    params: UGVParams,
    placed: Pose,
    friction: Real[Array, "..."] | float | tuple[Array, Array],
    min_grip: Real[Array, ""] | float | None = None,
    max_torque: Real[Array, ""] | float | None = None,
) -> SafeSplit:
    """The splits with |F| <= mu N - min_grip at both wheels, with a motor at each (eq. 42).

    friction: as of `balance`, numbers or of the pose's shape; less than 1e-6 counts as that. Forces
    do not depend on it: what grips at the lower end of an uncertain mu grips at all of it. F and N
    are linear in the difference, so each condition leaves a half-line. Only differences up to the
    weight are looked at. min_grip: what each wheel keeps [N]; max_torque: of each motor, either way
    [N m]; None: no such limit. Neglected: inertia.
    """
    given = {"friction": friction, "min_grip": min_grip, "max_torque": max_torque}
    for name, value in given.items():
        if value is not None:
            require_number(name, value, low=0.0, accepted="numbers >= 0")
    each = friction if isinstance(friction, tuple) else (friction, friction)
    mu_rear, mu_front = (jnp.maximum(mu, 1e-6) for mu in each)
    family, W = split_family(params, placed), params.weight
    (F, N), (dF, dN) = (  # F and mu N of both wheels [2, ...], and what a weight adds
        (jnp.stack(of[::2]), jnp.stack([mu_rear * of.N_rear, mu_front * of.N_front]))
        for of in family
    )
    left, grip = (N, None) if min_grip is None else (N - min_grip / W, min_grip / W)
    cones = (jnp.concatenate([n - f, n + f]) for f, n in ((F, left), (dF, dN)))
    limits = (N, dN) if max_torque is None else _limits(params, family, max_torque)
    (first, last), (low, high) = (
        (jnp.max(low, 0, initial=-1.0), jnp.min(high, 0, initial=1.0))
        for low, high in (where_positive(*limits), where_positive(*cones))
    )
    if max_torque is not None:
        low, high = jnp.maximum(low, first), jnp.minimum(high, last)
        between = jnp.clip(0.0, last, first)
        first, last = (jnp.where(first > last, between, of) for of in (first, last))
    tried = jnp.stack([first, last, *_same_shares(F, N, dF, dN, grip)])
    tried = jnp.clip(jnp.clip(tried, first, last), -1.0, 1.0)
    loads = N[:, None] + tried * dN[:, None]
    loaded = jnp.all(loads > 0, 0)
    used = jnp.abs(F[:, None] + tried * dF[:, None]) + (0.0 if grip is None else grip)
    uses = jnp.max(used / jnp.where(loaded, loads, 1.0), 0)
    uses = jnp.where(loaded, uses, jnp.inf)
    least = jnp.argmin(uses, 0, keepdims=True)
    best, use = (jnp.take_along_axis(of, least, 0)[0] for of in (tried, uses))
    difference = jnp.where(low <= high, jnp.clip(0.0, low, high), best)
    why = jnp.where(use < jnp.inf, Status.WHEEL_SLIP, Status.ROLLOVER).astype(jnp.int32)
    status = jnp.where((placed.status != Status.OK) | (low <= high), placed.status, why)
    return SafeSplit._make([*(of * W for of in (difference, low, high)), use, status])


def _limits(params: UGVParams, family: tuple[Forces, Forces], max_torque: Any) -> list[Values]:
    """N and what is left of max_torque, in weights, and what a weight adds to them [6, ...]."""
    c, most, found = params.rolling_resistance, max_torque / params.weight, []
    for of, left in zip(family, (most / params.wheel_radius, 0.0), strict=True):
        F, N = jnp.stack(of[::2]), jnp.stack(of[1::2])
        pull = F if c is None else F + c * N
        found.append(jnp.concatenate([N, left - pull, left + pull]))
    return found


def _same_shares(F: Values, N: Values, dF: Values, dN: Values, grip: Any) -> list[Values]:
    """Differences where both wheels' (|F| + grip) / (mu N) are equal, roots of quadratics (anything
    where there are none), or F is 0: the larger is least there or at the end of the interval."""

    def product(F: Values, N: Values) -> Values:
        return jnp.stack([F[0] * N[1] - F[1] * N[0], F[0] * N[1] + F[1] * N[0]])

    A, B, C = product(dF, dN), product(F, dN) + product(dF, N), product(F, N)
    rest = []
    if grip is not None:
        of_B, of_C = grip * (dN[1] - dN[0]), grip * (N[1] - N[0])
        A, B, C = (jnp.concatenate([a + b, a - b]) for a, b in ((A, 0.0), (B, of_B), (C, of_C)))
        rest = [*(-F / jnp.where(dF == 0, 1.0, dF))]
    square = B * B - 4 * A * C
    root = jnp.where(square > 0, jnp.sqrt(jnp.where(square > 0, square, 1.0)), 0.0)
    q = -(B + jnp.where(B < 0, -root, root)) / 2
    return [*(C / jnp.where(q == 0, 1.0, q)), *(q / jnp.where(A == 0, 1.0, A)), *rest]


def weight_moment(params: UGVParams, placed: Pose, x: Values) -> Values:
    """Clockwise moment of the five weights about a point at x [N m]."""
    wheels = placed.rear.centre[..., 0] + placed.front.centre[..., 0] - 2 * x
    legs = placed.rear_leg[..., 0] + placed.front_leg[..., 0] - 2 * x
    body = placed.body[..., 0] - x
    mass = params.wheel_mass * wheels + params.leg_mass * legs + params.body_mass * body
    return mass * params.gravity


def leg_torques(params: UGVParams, placed: Pose, forces: Forces) -> Points:
    """Torques of the leg actuators [..., 2], rear and front [N m], positive outwards.

    The moment about its hinge of all that acts on a leg and its wheel from outside, balanced. By
    virtual work it is the slope of the potential energy in the leg's angle, less the wheels' work,
    and more what rolling resistance takes.
    """
    rear = _moment(params, placed.rear, placed.rear_leg, placed.rear_hinge, *forces[:2])
    front = _moment(params, placed.front, placed.front_leg, placed.front_hinge, *forces[2:])
    # The rear leg swings outwards clockwise, the front one anticlockwise.
    return jnp.stack([rear, -front], -1)


def _moment(
    params: UGVParams, wheel: WheelContact, leg: Points, hinge: Points, F: Values, N: Values
) -> Values:
    """Anticlockwise moment about the hinge of all from the ground, and the weights [N m]."""
    force = F[..., None] * wheel.tangent + N[..., None] * wheel.normal
    weights = (
        params.wheel_mass * (wheel.centre[..., 0] - hinge[..., 0])
        + params.leg_mass * (leg[..., 0] - hinge[..., 0])
    ) * params.gravity
    moment = cross(wheel.point - hinge, force) - weights
    c = params.rolling_resistance
    return moment if c is None else moment + c * params.wheel_radius * N
