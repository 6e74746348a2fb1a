"""Poses of the UGV: the rear contact from the front one (eqs. 38 and 39), and all centres."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_kind, require_number
from stickslip.dynamics.numeric import Lists, Number, float_type
from stickslip.dynamics.ugv.batches import over_poses
from stickslip.dynamics.ugv.contact.clearance import clearance, wheel_clearance
from stickslip.dynamics.ugv.contact.placed import Pose
from stickslip.dynamics.ugv.contact.pose_status import status_of
from stickslip.dynamics.ugv.contact.wheel import contact, cross, dot
from stickslip.dynamics.ugv.params import UGVParams, legs
from stickslip.dynamics.ugv.pose_solver import NEWTON, PoseSolver, locate
from stickslip.dynamics.ugv.track import Track, track_of

if TYPE_CHECKING:
    from jaxtyping import Array, Real

    from stickslip.dynamics.ugv.ground.shapes import Points


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
    track, x_front, leg_angles = require_place(params, track, x_front, leg_angles, solver)
    return _place(params, track, x_front, leg_angles, solver)


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
    shapes = {"x_front": np.shape(x_front), "leg_angles": np.shape(leg_angles)[:-1]}
    vehicles = {name: value for name, value in vars(params).items() if np.ndim(value)}
    shapes |= {name: np.shape(value) for name, value in (others | vehicles).items()}
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ValueError(
            f"the shapes {listed} do not go together (leg_angles without its last axis); "
            "accepted: the same, or 1"
        ) from None
    track.require_resolved(float_type(params, track, x_front, leg_angles))
    listed = (list, tuple)
    x_front, leg_angles = (
        jnp.asarray(v, float) if isinstance(v, listed) else v for v in (x_front, leg_angles)
    )
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
    norm = jnp.sqrt(cos**2 + sin**2)
    along = jnp.stack([cos, sin], -1) / norm[..., None]

    def in_world(point: Points) -> Points:
        return rear.centre + turned(point - rear_wheel, along)

    zero = jnp.zeros_like(R)
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
        wheel_clearance=zero + jnp.inf if solver.overlap else wheel_clearance(params, R),
        status=zero.astype(int),
        origin=jnp.stack([x_front, sum(ground.anchor)], -1),
    )
    placed = placed._replace(clearance=clearance(params, ground, placed, solver.samples))
    return placed._replace(status=status_of(params, ground, placed, (gap, rate), solver))


@partial(jax.jit, static_argnums=4)
def _place(
    params: UGVParams,
    track: Track,
    x_front: Real[Array, "..."],
    leg_angles: Real[Array, "... 2"],
    solver: PoseSolver,
) -> Pose:
    return over_poses(_placed, (solver,), params, track, x_front, leg_angles)


def _placed(
    solver: PoseSolver,
    params: UGVParams,
    track: Track,
    x_front: Real[Array, "..."],
    leg_angles: Real[Array, "... 2"],
) -> Pose:
    return place(params, track, x_front, leg_angles, solver)


def turned(vector: Points, along: Points) -> Points:
    """The vector in the world, given in a frame whose x axis is the unit vector `along`."""
    x, y = vector[..., 0], vector[..., 1]
    cos, sin = along[..., 0], along[..., 1]
    return jnp.stack([cos * x - sin * y, sin * x + cos * y], -1)
