"""Angles that the wheels have turned, over which the motors work."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.dynamics.ugv.contact.placed import Pose
from stickslip.dynamics.ugv.odometer import Odometer
from stickslip.dynamics.ugv.params import UGVParams

if TYPE_CHECKING:
    from jaxtyping import Array, Float


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
    return (
        wheel_lags(params, odometer, placed, leg_angles) - (level / params.wheel_radius)[..., None]
    )


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
