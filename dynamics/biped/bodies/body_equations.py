"""Newton's and Euler's equations of the 24 bodies, from the pin table (eqs. 18 and 29)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.coefficients.inertia import body_masses
from stickslip.dynamics.biped.links import BODIES, LINK_OF_BODY
from stickslip.dynamics.biped.mechanism.joints import CRANK_PIN, SIGNS, body_of, joint_geometry
from stickslip.dynamics.numeric import same_rank

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.mechanism.link_motion import LinkMotion
    from stickslip.dynamics.biped.params import BipedParams

FOOT, CRANK, HIP = (body_of(link, 0) for link in (1, *CRANK_PIN[:2]))
"""Indices in BODIES of the supporting foot, the crank and the hip."""

ALPHA, SQUARE, SLIDE, GRAVITY = range(4)
"""Columns of `BodyEquations.loads`."""


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
