"""Motion of all links, and Newton's and Euler's equations of the 24 bodies (eqs. 17-25, 29).

The links' motion is exact, or by the chapter's forward differences. Velocities and accelerations
are its derivatives by the crank angle times the crank's (eqs. 17 and 20-22).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.inertia import body_masses
from stickslip.dynamics.biped.joints.pins import CRANK_PIN, SIGNS, body_of, joint_geometry
from stickslip.dynamics.biped.links import (
    BODIES,
    LINK_OF_BODY,
    LegPins,
    centres_and_angles,
    kinematics,
)
from stickslip.dynamics.numeric import same_rank

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams

    Places = tuple[Float[Array, "24 2"], Float[Array, " 24"]]

FOOT, CRANK, HIP = (body_of(link, 0) for link in (1, *CRANK_PIN[:2]))
"""Indices in BODIES of the supporting foot, the crank and the hip."""

ALPHA, SQUARE, SLIDE, GRAVITY = range(4)
"""Columns of `BodyEquations.loads`."""


class LinkMotion(NamedTuple):
    """Positions of the 24 bodies and their derivatives by the crank angle; order of BODIES.

    Ground frame, origin at the supporting ankle; the slide x1 of eq. 16 is not included.
    """

    centres: Float[Array, "24 2"]
    """Centres of mass [m]."""
    centre_slopes: Float[Array, "24 2"]
    """Their first derivative X', y' [m/rad]."""
    centre_curvatures: Float[Array, "24 2"]
    """Their second derivative X'', y'' [m/rad^2]."""
    angles: Float[Array, " 24"]
    """Link angles [rad], modulo 2 pi."""
    angle_slopes: Float[Array, " 24"]
    angle_curvatures: Float[Array, " 24"]
    pins: LegPins
    """Pins of both legs, each [2, 2] m."""
    hip_pins: Float[Array, "3 2"]
    """A, B and D [m]."""


def link_motion(
    params: BipedParams, theta: Float[Array, ""], difference_step: float | None = None
) -> LinkMotion:
    """Motion of all links at crank angle `theta` [rad] of the supporting leg.

    difference_step None: exact, by differentiating the closed linkage forwards twice. A number D
    [rad]: the chapter's forward differences. Positions are exact at `theta` either way. Static
    choice; scalars, batch with vmap.
    """
    if difference_step is None:
        return _exact_motion(params, theta)
    return _differenced_motion(params, theta, difference_step)


def _exact_motion(params: BipedParams, theta: Float[Array, ""]) -> LinkMotion:
    """Derivatives of the kinematics by forward-mode differentiation, to rounding."""
    one = jnp.ones_like(theta)

    def slope(angle: Float[Array, ""]):
        return jax.jvp(lambda at: centres_and_angles(params, at), (angle,), (one,))

    (places, slopes), (_, curvatures) = jax.jvp(slope, (theta,), (one,))
    return _motion(params, theta, places, slopes, curvatures)


def _differenced_motion(params: BipedParams, theta: Float[Array, ""], step: float) -> LinkMotion:
    """Eqs. (23)-(25) with D = `step` [rad], first order in D.

    q' = (q(theta + D) - q(theta)) / D and q'' = (q(theta + 2D) - 2 q(theta + D) + q(theta)) / D^2;
    the chapter prints q(theta) for q(theta + D) in the second. Rounding adds about eps/D^2 to q'':
    in single precision more than 10 % of it at D = 1e-3.
    """
    require_difference_step(step)
    now, ahead, further = (centres_and_angles(params, theta + shift * step) for shift in (0, 1, 2))
    first = jax.tree.map(_change, now, ahead)
    second = jax.tree.map(_change, ahead, further)
    slopes = jax.tree.map(lambda change: change / step, first)
    curvatures = jax.tree.map(lambda a, b: (b - a) / step**2, first, second)
    return _motion(params, theta, now, slopes, curvatures)


def require_difference_step(step: float) -> None:
    """Raise ValueError unless `step` is a number in (0, 0.5] rad."""
    number = isinstance(step, int | float | np.number) and not isinstance(step, bool)
    if not number or not 0.0 < float(step) <= 0.5:
        raise ValueError(
            f"difference_step = {step!r}; accepted: None (exact) or a crank angle in (0, 0.5] rad"
        )


def _change(before: Float[Array, "..."], after: Float[Array, "..."]) -> Float[Array, "..."]:
    """after - before; angles, the array of rank 1, by the shorter way round."""
    change = after - before
    if change.ndim > 1:
        return change
    return change - 2 * np.pi * jnp.round(change / (2 * np.pi))


def _motion(
    params: BipedParams, theta: Float[Array, ""], places: Places, slopes: Places, curvatures: Places
) -> LinkMotion:
    now = kinematics(params, theta)
    (centres, angles), (d_centres, d_angles), (dd_centres, dd_angles) = places, slopes, curvatures
    return LinkMotion(
        centres,
        d_centres,
        dd_centres,
        angles,
        d_angles,
        dd_angles,
        pins=now.pins,
        hip_pins=now.hip_pins,
    )


class BodyEquations(NamedTuple):
    """forces @ joint_forces + torque T + ground (f, N, moment) = loads @ (alpha, w^2, a1, g).

    Three rows per body: x, y, and moments about its centre of mass, ground frame.
    """

    forces: Float[Array, "24 3 68"]
    """Columns of unit joint forces, in the order of JOINT_FORCES [-, -, m]."""
    torque: Float[Array, "24 3"]
    """Column of a unit motor torque: +1 on the crank, -1 on the hip."""
    ground: Float[Array, "24 3 3"]
    """Columns of unit friction, normal force and ground moment, the forces at the ankle."""
    loads: Float[Array, "24 3 columns"]
    """Mass times acceleration, I times turning acceleration, of unit crank acceleration, crank
    rate squared, foot acceleration; and minus the weight of unit gravity: 4 columns, or one of a
    motion that is made of them."""


def body_equations(params: BipedParams, motion: LinkMotion) -> BodyEquations:
    """The 72 equations of one instant: 3 for each body (eq. 18), the supporting foot's (29, 30).

    The ankle is taken at ground level. Neglected: friction in pins and slots.
    """
    points, directions = joint_geometry(motion.pins, motion.hip_pins)
    dtype = motion.centres.dtype
    signs = jnp.asarray(SIGNS, dtype)
    moments = cross(points[None] - motion.centres[:, None], directions)  # [24, 68]
    x, y = directions[None, :, 0], directions[None, :, 1]
    forces = jnp.stack([signs * x, signs * y, signs * moments], axis=1)
    torque = np.zeros((len(BODIES), 3))
    torque[CRANK, 2], torque[HIP, 2] = 1, -1
    to_ankle = motion.pins.E[0] - motion.centres[FOOT]
    # f turns the foot by -arm_y f, N by arm_x N
    ground = jnp.asarray(np.eye(3), dtype).at[2, :2].set(jnp.stack([-to_ankle[1], to_ankle[0]]))
    everywhere = jnp.zeros((len(BODIES), 3, 3), dtype).at[FOOT].set(ground)
    return BodyEquations(forces, jnp.asarray(torque, dtype), everywhere, _loads(params, motion))


def _loads(params: BipedParams, motion: LinkMotion) -> Float[Array, "24 3 4"]:
    mass, inertia = body_masses(params)[:, None], jnp.asarray(params.inertia)[LINK_OF_BODY]

    def of(centres: Float[Array, "24 2"], angles: Float[Array, " 24"]) -> Float[Array, "24 3"]:
        return jnp.concatenate([mass * centres, (inertia * angles)[:, None]], axis=1)

    zero, one = jnp.zeros_like(motion.centres), jnp.zeros_like(motion.centres) + 1
    still = jnp.zeros_like(motion.angles)
    unit = jnp.asarray(np.eye(2), motion.centres.dtype)
    columns = [
        of(motion.centre_slopes, motion.angle_slopes),
        of(motion.centre_curvatures, motion.angle_curvatures),
        of(zero + unit[:1], still),
        of(one * unit[1:], still),
    ]
    return jnp.stack(columns, axis=-1)


def ground_balance(equations: BodyEquations, motion: LinkMotion) -> Float[Array, "3 columns"]:
    """Friction, normal force and moment about the ankle, per column of `loads` (eqs. 29-30).

    The sum of all bodies' equations, moments about the ankle: joint forces and torque cancel.
    """
    arms = motion.centres - motion.pins.E[:1]
    loads = equations.loads
    moments = loads[:, 2] + arms[:, :1] * loads[:, 1] - arms[:, 1:] * loads[:, 0]
    return jnp.sum(jnp.stack([loads[:, 0], loads[:, 1], moments], axis=1), axis=0)


def cross(a: Float[Array, "*#n 2"], b: Float[Array, "*#n 2"]) -> Float[Array, "..."]:
    """The plane's cross product a_x b_y - a_y b_x, of vectors whose batches broadcast."""
    ax, ay, bx, by = same_rank(a[..., 0], a[..., 1], b[..., 0], b[..., 1])
    return ax * by - ay * bx
