"""Poses of the UGV: the rear contact from the front one (eqs. 38 and 39), and all centres."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from itertools import pairwise
from math import prod
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.kernels.fused import fused, where_needed
from stickslip.dynamics.kernels.jax_interface import jvp_in_front
from stickslip.dynamics.pytrees import Lists, Number, float_type, require_broadcast
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv.ground.shapes import nowhere_hollow
from stickslip.dynamics.ugv.params import UGVParams, legs
from stickslip.dynamics.ugv.track import Odometer, Track, track_of
from stickslip.dynamics.ugv.wheel import (
    NEWTON,
    PoseSolver,
    WheelContact,
    contact,
    cross,
    depth_allowed,
    dot,
    locate,
    penetration,
    size_near,
)

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int, Real

    from stickslip.dynamics.ugv.ground.shapes import Near, Points, Values

Result = TypeVar("Result")


def pose(
    params: UGVParams,
    track: Track | str,
    x_front: Real[Number, "..."] | Lists,
    leg_angles: Real[Number, "... 2"] | Lists,
    *,
    solver: PoseSolver = NEWTON,
) -> Pose:
    """Place the vehicle with its front wheel touching at x_front (eqs. 38, 39; MODEL 2).

    x_front: [...] [m]. leg_angles: [..., 2], rear and front [rad]. params: its numbers, too, may be
    arrays [...] that go with these: a column of vehicles is put at a row of places. track: a Track,
    or one of TRACKS by its name. solver: how the rear wheel is found, and what is checked. The rear
    contact lies behind the front one, where the path of the wheel's centre meets the circle of
    radius R about the front centre, in a bracket that always holds such a point. Differentiable in
    every number (implicit function theorem).

    Computed relative to the front contact (`stand`) and only then put into the world frame.

    Raises ValueError for angles outside the range or numbers that are not finite, before tracing.
    Neglected: the wheels' width.
    """
    placing = require_place(params, track, x_front, leg_angles, solver)
    return poses_at(_placed, (solver,), params, *placing)


def require_place(
    params: UGVParams,
    track: Track | str,
    x_front: Any,
    leg_angles: Any,
    solver: PoseSolver,
    **others: Any,
) -> tuple[Track, Number, Number]:
    """The track, and x_front and leg_angles as arrays, or ValueError for what places no vehicle;
    others: numbers whose shapes have to go with theirs."""
    require_kind("params", params, UGVParams, "a UGVParams")
    track = track_of(track)
    require_kind("solver", solver, PoseSolver, "a PoseSolver")
    params.validate()
    require_number("x_front", x_front, accepted="finite numbers [m]")
    params.check_leg_angles(leg_angles)
    angles = np.broadcast_to(0, np.shape(leg_angles)[:-1])
    require_broadcast(x_front=x_front, leg_angles=angles, **others, **vars(params))
    track.require_resolved(float_type(params, track, x_front, leg_angles))
    given, listed = (x_front, leg_angles), (list, tuple)
    x_front, leg_angles = (jnp.asarray(v, float) if isinstance(v, listed) else v for v in given)
    return track, x_front, leg_angles


def place(
    params: UGVParams,
    track: Track,
    x_front: Real[Number, "..."],
    leg_angles: Real[Number, "... 2"],
    solver: PoseSolver,
) -> Pose:
    """`pose` without checks, for use inside a trace."""
    return stand(params, track, x_front, leg_angles, solver).in_world()


def stand(
    params: UGVParams,
    track: Track,
    x_front: Real[Number, "..."],
    leg_angles: Real[Number, "... 2"],
    solver: PoseSolver,
) -> Pose:
    """`place` with the points counted from where the front wheel touches, in x and in height.

    So nothing depends on how far the track lies from x = 0 and y = 0 but `origin`. Forces, torques
    and differences are best taken of this pose.
    """
    dtype = float_type(params, track, x_front, leg_angles)
    x_front, leg_angles = jnp.asarray(x_front, dtype), jnp.asarray(leg_angles, dtype)
    shape = jnp.broadcast_shapes(x_front.shape, leg_angles.shape[:-1])
    x_front = jnp.broadcast_to(x_front, shape)
    leg_angles = jnp.broadcast_to(leg_angles, (*shape, 2))

    rear_wheel, front_wheel = legs(params, leg_angles)
    chord = front_wheel - rear_wheel
    R = jnp.sqrt(dot(chord, chord))
    ground = track.seen_from(x_front)
    front = contact(ground, jnp.zeros_like(x_front), params.wheel_radius)
    x_rear, gap, rate = locate(ground, params.wheel_radius, front, R, solver)
    rear = contact(ground, x_rear, params.wheel_radius)

    # The body's axis: the chord in the body's frame is turned into the chord in the world.
    world = front.centre - rear.centre
    cos, sin = dot(chord, world), cross(chord, world)
    along = jnp.stack([cos, sin], -1) / jnp.sqrt(cos**2 + sin**2)[..., None]

    def in_world(point: Points) -> Points:
        (x, y), (c, s) = ((of[..., 0], of[..., 1]) for of in (point - rear_wheel, along))
        return rear.centre + jnp.stack([c * x - s * y, s * x + c * y], -1)

    zero, apart = jnp.zeros_like(R), 2 * params.wheel_radius + params.wheel_gap
    hinge = jnp.stack([zero + params.body_length, zero], -1)
    rear_hinge, front_hinge = in_world(jnp.zeros_like(hinge)), in_world(hinge)
    placed = Pose(
        rear=rear,
        front=front,
        wheelbase=R,
        pitch=jnp.arctan2(sin, cos),
        rear_hinge=rear_hinge,
        front_hinge=front_hinge,
        body=(rear_hinge + front_hinge) / 2,
        rear_leg=(rear_hinge + rear.centre) / 2,
        front_leg=(front_hinge + front.centre) / 2,
        clearance=zero,
        wheel_clearance=zero + jnp.inf if solver.overlap else R - apart,
        status=zero.astype(int),
        origin=jnp.stack([x_front, sum(ground.anchor)], -1),
    )
    placed = placed._replace(clearance=clearance(params, ground, placed, solver.samples))
    return placed._replace(status=status_of(params, ground, placed, (gap, rate), solver))


def _placed(solver: PoseSolver, *given: Any) -> Pose:
    return place(*given, solver=solver)


def status_of(
    params: UGVParams, ground: Near, placed: Pose, missed: tuple[Values, Values], solver: PoseSolver
) -> Int[Array, "..."]:
    """The first of the pose's failures that applies."""
    dtype = placed.wheelbase.dtype
    eps = jnp.finfo(dtype).eps
    r = params.wheel_radius
    size = size_near(ground, placed.wheelbase, r)
    gap, rate = missed
    # At a sharp edge the last digit of x moves the wheel by far more than that.
    accepted = solver.gap(dtype, 64) * size * jnp.maximum(jnp.abs(rate), 1)
    status = jnp.where(jnp.abs(gap) > accepted, Status.NOT_CONVERGED, Status.OK)
    hollow = (placed.rear.stretch <= 0) | (placed.front.stretch <= 0)
    if solver.samples:
        hollow |= _entered(ground, placed, r, size, solver.samples)
    status = jnp.where(hollow & (status == 0), Status.HOLLOW_GROUND, status)
    vanished = placed.wheelbase <= 16 * eps * params.body_length
    status = jnp.where(vanished, Status.NO_SOLUTION, status)
    numbers = placed.wheelbase + placed.pitch + placed.rear.x + sum(ground.anchor) + size
    return jnp.where(jnp.isfinite(numbers), status, Status.NON_FINITE).astype(jnp.int32)


def _entered(
    ground: Near, placed: Pose, radius: Values | float, size: Values, samples: int
) -> Bool[Array, "..."]:
    """True if the ground enters a wheel; looked up only where its own numbers leave it open."""

    def look(ground: Near, rear: WheelContact, front: WheelContact, radius: Values, size: Values):
        wheels = rear, front
        depth = jnp.maximum(*(penetration(ground, wheel, radius, samples) for wheel in wheels))
        return depth > depth_allowed(size)

    numbers = (ground, placed.rear, placed.front, jnp.asarray(radius, size.dtype), size)
    proved = nowhere_hollow(ground.shape, radius)
    if proved is None:
        return look(*numbers)
    never = jnp.zeros(jnp.shape(size), bool)
    return where_needed(~jnp.all(proved), look, jax.lax.stop_gradient(numbers), never)


class Pose(NamedTuple):
    """The half vehicle on the track; points [..., 2] [m], y up, x forwards.

    In the world frame, or, out of `stand`, from `origin`, which keeps the digits of differences
    far from x = 0 and y = 0; `in_world` adds it.
    """

    rear: WheelContact
    front: WheelContact
    wheelbase: Float[Array, "..."]
    """R: between the wheel centres [m] (eq. 39)."""
    pitch: Float[Array, "..."]
    """Angle of the body above the horizontal, nose up positive [rad]."""
    rear_hinge: Float[Array, "... 2"]
    front_hinge: Float[Array, "... 2"]
    body: Float[Array, "... 2"]
    """Centre of mass of the body; of the legs below."""
    rear_leg: Float[Array, "... 2"]
    front_leg: Float[Array, "... 2"]
    clearance: Float[Array, "..."]
    """Least height above the ground [m], measured vertically at points of the body, a line from
    hinge to hinge, and of the legs as far as they stand out of the wheels."""
    wheel_clearance: Float[Array, "..."]
    """Between the wheels [m]: wheelbase - 2 r - wheel_gap. Negative: they overlap."""
    status: Int[Array, "..."]
    """OK, NO_SOLUTION (the wheelbase vanishes), NOT_CONVERGED, HOLLOW_GROUND or NON_FINITE."""
    origin: Float[Array, "... 2"]
    """Of the points' frame in the world [m]: zero, or out of `stand` the front contact."""

    def potential_energy(self, params: UGVParams) -> Values:
        """Potential energy above y = 0 [J]; far up, energy_above_origin keeps more digits."""
        return self.energy_above_origin(params) + params.weight * self.origin[..., 1]

    def energy_above_origin(self, params: UGVParams) -> Values:
        """Potential energy of all five bodies above `origin` [J]."""
        wheels = params.wheel_mass * (self.rear.centre[..., 1] + self.front.centre[..., 1])
        legs = params.leg_mass * (self.rear_leg[..., 1] + self.front_leg[..., 1])
        return (wheels + legs + params.body_mass * self.body[..., 1]) * params.gravity

    def in_world(self) -> Pose:
        """The same with every point in the world frame."""
        by = self.origin

        def moved(at: WheelContact) -> WheelContact:
            return at._replace(x=at.x + by[..., 0], point=at.point + by, centre=at.centre + by)

        points = ("rear_hinge", "front_hinge", "body", "rear_leg", "front_leg")
        return self._replace(
            rear=moved(self.rear),
            front=moved(self.front),
            origin=jnp.zeros_like(by),
            **{name: getattr(self, name) + by for name in points},
        )


def clearance(params: UGVParams, ground: Near, placed: Pose, samples: int) -> Values:
    """Least height above the ground of the body and of what the wheels leave of the legs [m]."""
    if samples == 0:
        return jnp.full_like(placed.wheelbase, jnp.inf)
    bare = jnp.maximum(1 - params.wheel_radius / params.leg_length, 0)
    rear = placed.rear_hinge + bare * (placed.rear.centre - placed.rear_hinge)
    front = placed.front_hinge + bare * (placed.front.centre - placed.front_hinge)
    corners = [rear, placed.rear_hinge, placed.front_hinge, front]
    return _least_height(samples, ground, [(a, b - a) for a, b in pairwise(corners)])


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _least_height(samples: int, ground: Near, lines: list[tuple[Points, Points]]) -> Values:
    """Least height of `samples` points on each line (begin, way) above the ground [m].

    One point after the other: for a batch their numbers stay in the nearest cache. Derivatives are
    those of jnp.min, which divides them among points of the same height.
    """

    def look(place, least):
        part = (jnp.asarray(place, least.dtype) + 0.5) / samples
        for begin, way in lines:
            x, y = begin[..., 0] + part * way[..., 0], begin[..., 1] + part * way[..., 1]
            least = jnp.minimum(least, y - ground.height(x))
        return least

    return jax.lax.fori_loop(0, samples, look, jnp.full_like(lines[0][0][..., 0], jnp.inf))


@_least_height.defjvp
def _least_height_jvp(samples: int, primals, tangents):
    def at_once(ground, lines):
        lowest = []
        for begin, way in lines:
            (x, y), (along, up) = ((v[..., :1], v[..., 1:]) for v in (begin, way))
            part = (jnp.arange(samples, dtype=x.dtype) + 0.5) / samples
            lowest.append(jnp.min(y + part * up - ground.height(x + part * along), axis=-1))
        return reduce(jnp.minimum, lowest)

    return jvp_in_front(at_once, primals, tangents)


def over_poses(
    function: Callable[..., Result],
    fixed: tuple[Any, ...],
    params: UGVParams,
    ground: Any,
    x_front: Real[Number, "..."],
    leg_angles: Real[Number, "... 2"],
    *numbers: Any,
) -> Result:
    """function(*fixed, params, ground, x_front, leg_angles, *numbers), in one kernel if it can be.

    function: elementwise over leading axes of x_front, leg_angles, the vehicle's and the other
    numbers (pytrees), with a `status` among its results. fixed: hashable. ground: shared pytrees.
    On ground that is a batch, or with numbers of more axes than the poses, it is called as it is.
    """
    given = (params, ground, x_front, leg_angles, *numbers)
    dtype = float_type(params, ground, x_front, leg_angles)

    def as_float(leaf: Any) -> Array:
        kind = jnp.result_type(leaf)
        return jnp.asarray(leaf, dtype if jnp.issubdtype(kind, jnp.floating) else kind)

    params_, ground_, x, angles, *others = jax.tree.map(as_float, given)
    own = (params_, *others)
    vehicles = [leaf.shape for leaf in jax.tree.leaves(params_)]
    shape: Any = jnp.broadcast_shapes(x.shape, angles.shape[:-1], *vehicles)
    leaves = jax.tree.leaves(others)
    sizes = (zip(leaf.shape[::-1], shape[::-1], strict=False) for leaf in leaves)
    if not (
        prod(shape) > 0
        and float_type(dtype.type(0), *numbers) == dtype
        and all(leaf.ndim <= len(shape) for leaf in leaves)
        and all(n in (1, m) for pairs in sizes for n, m in pairs)
        and _shared(function, fixed, params_, ground_, others, dtype)
    ):
        return function(*fixed, *given)
    one = fused(function, fixed=len(fixed))
    if shape == ():
        return one(*fixed, params_, ground_, x, angles, *others)

    def flat(leaf: Array) -> Array:
        return jnp.broadcast_to(leaf, shape).reshape(-1) if leaf.ndim else leaf

    axes = jax.tree.map(lambda leaf: 0 if leaf.ndim else None, own)
    params_, *others = jax.tree.map(flat, own)
    x = jnp.broadcast_to(x, shape).reshape(-1)
    angles = jnp.broadcast_to(angles, (*shape, 2)).reshape(-1, 2)

    def each(params, x, angles, *others):
        return one(*fixed, params, ground_, x, angles, *others)

    found = jax.vmap(each, (axes[0], 0, 0, *axes[1:]))(params_, x, angles, *others)
    return jax.tree.map(lambda leaf: leaf.reshape(*shape, *leaf.shape[1:]), found)


poses_at = jax.jit(over_poses, static_argnums=(0, 1))


def _shared(
    function: Callable, fixed: tuple, params: UGVParams, ground: Any, numbers: list, dtype: Any
) -> bool:
    """True if the ground is one for all poses, and nothing traced hides in a function of it."""

    def one(leaf: Array) -> jax.ShapeDtypeStruct:
        return jax.ShapeDtypeStruct((), leaf.dtype)

    def status(params, ground, x, angles, *numbers):
        return function(*fixed, params, ground, x, angles, *numbers).status

    places = jax.ShapeDtypeStruct((), dtype), jax.ShapeDtypeStruct((2,), dtype)
    ground = jax.tree.map(lambda leaf: jax.ShapeDtypeStruct(leaf.shape, leaf.dtype), ground)
    params, *numbers = jax.tree.map(one, (params, *numbers))
    try:
        traced = jax.make_jaxpr(status)(params, ground, *places, *numbers)
    except (TypeError, ValueError):  # shapes that do not go with one place
        return False
    hidden = any(isinstance(one, Tracer) for one in traced.consts)
    return not hidden and traced.out_avals[0].shape == ()


def wheel_turns(
    params: UGVParams, odometer: Odometer, placed: Pose, leg_angles: Float[Array, "... 2"]
) -> Float[Array, "... 2"]:
    """Angles of the rear and the front wheel relative to their legs [..., 2] [rad].

    Anticlockwise positive, so driving forwards they fall. Only differences mean something. A wheel
    that rolls without slip has turned by beta - S / r in the world: its centre goes along the
    ground's arc length S less r times the change of slope angle. From that the leg's angle is
    taken, pitch - phi_r or pitch + phi_f. With the motors' torque M on each wheel,

        M d(turn_rear + turn_front) + leg torques . d(leg angles) = d(potential energy)

    for every displacement along the track and of the legs (virtual work, MODEL 2).
    """
    level = (placed.origin[..., 0] + placed.front.x) - odometer.start
    lags = wheel_lags(params, odometer, placed, leg_angles)
    return lags - (level / params.wheel_radius)[..., None]


def wheel_lags(
    params: UGVParams, odometer: Odometer, placed: Pose, leg_angles: Float[Array, "... 2"]
) -> Float[Array, "... 2"]:
    """`wheel_turns` less what rolling over level ground to the front contact would take, [rad].

    That is -(x_front - start) / r, by far the larger part of a long way: the lag keeps in single
    precision the digits that the turn loses.
    """
    base = placed.origin[..., 0] + placed.front.x
    lags = []
    for wheel, leg in ((placed.rear, -leg_angles[..., 0]), (placed.front, leg_angles[..., 1])):
        behind = wheel.x - placed.front.x
        rolled = behind + odometer.excess_at(base, behind)
        lags.append(wheel.slope_angle - rolled / params.wheel_radius - placed.pitch - leg)
    return jnp.stack(lags, -1)
