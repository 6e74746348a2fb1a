"""Forces and accelerations at one instant: inverse and forward, by the reduced equations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.contact import (
    ForwardDynamics,
    Friction,
    System,
    Torque,
    ankle_moment,
    at_instant,
    ground_force,
    motor_torque,
    zero_moment_point,
)
from stickslip.dynamics.biped.inertia import ExactInertia, inertia_and_moment
from stickslip.dynamics.biped.joints import JointInertia
from stickslip.dynamics.biped.links import closing_margin
from stickslip.dynamics.biped.model import BipedModel, prepare
from stickslip.dynamics.biped.settings import Fidelity
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.numeric import Number
from stickslip.dynamics.pytrees import all_finite, float_type, rebuilt
from stickslip.dynamics.scene import OUTPUTS, Scene, Uniform
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int, Real

    from stickslip.dynamics.biped.params import BipedParams


class InverseDynamics(NamedTuple):
    """Torque and forces of a prescribed motion; forces on the foot, ground frame."""

    torque: Float[Array, ""]
    """Motor torque between hip and crank [N m]."""
    friction_force: Float[Array, ""]
    normal_force: Float[Array, ""]
    zmp: Float[Array, ""]
    """Zero-moment point from the ankle, forwards [m]."""
    joint_forces: Any
    """Joint forces [68] in the order of JOINT_FORCES [N] with outputs="joints"; else None."""
    status: Int[Array, ""]
    """A Status: OK, NO_SOLUTION where the linkage cannot close, or NON_FINITE."""


def inverse_dynamics(
    params: BipedParams,
    theta: Real[Number, ""],
    crank_rate: Real[Number, ""],
    crank_acceleration: Real[Number, ""],
    foot_velocity: Real[Number, ""] = 0.0,
    foot_acceleration: Real[Number, ""] = 0.0,
    *,
    outputs: str = "forces",
) -> InverseDynamics:
    """Torque and ground force of a prescribed motion (eqs. 18-19 and 30-31, reduced: MODEL 1.4).

    theta [rad] of the supporting leg, rates [rad/s, rad/s^2], foot [m/s, m/s^2]. No friction law:
    the force that the motion needs, whether the floor can give it or not. The foot's velocity does
    not enter (Galilei); it is an argument so that both dynamics take the same state. Exact.
    outputs: "forces", or "joints" for the forces in the joints, too.
    """
    require_choice("outputs", outputs, ("forces", "joints"))
    theta, crank_rate, alpha, speed, a1 = _floats(
        params, theta, crank_rate, crank_acceleration, foot_velocity, foot_acceleration
    )
    inertia, at = inertia_and_moment(params, theta)
    torque = motor_torque(params, inertia, crank_rate, alpha, a1)
    friction, normal = ground_force(params, inertia, crank_rate, alpha, a1)
    zmp = zero_moment_point(ankle_moment(params, at, crank_rate, alpha, a1), normal)
    joints = None
    if outputs == "joints":
        joints = JointInertia(params).joint_forces(theta, crank_rate, alpha, a1)
    closes = closing_margin(params, theta) >= 0
    numbers = (theta, crank_rate, alpha, speed, a1, torque, friction, normal, zmp, joints)
    status = jnp.where(closes, Status.OK, Status.NO_SOLUTION)
    status = jnp.where(all_finite(numbers), status, Status.NON_FINITE).astype(jnp.int32)
    return InverseDynamics(torque, friction, normal, zmp, joints, status)


def forward_dynamics(
    params: BipedParams | BipedModel,
    theta: Real[Number, ""],
    crank_rate: Real[Number, ""],
    foot_velocity: Real[Number, ""],
    torque: Real[Number, ""],
    mu_static: Real[Number, ""],
    mu_kinetic: Real[Number, ""],
    *,
    fidelity: Fidelity = "reduced",
    outputs: str = "forces",
) -> ForwardDynamics:
    """Accelerations and ground force under a motor torque, with friction (MODEL 1.4, eqs. 26-36).

    theta [rad] of the supporting leg, crank_rate [rad/s], foot_velocity [m/s], torque [N m] of the
    motor on the crank. Foot at rest: sticks inside the static cone, else slides against the
    tendency. Scalars: batch with vmap. fidelity: see Fidelity. outputs: as in Scene. Never raises
    or returns NaN from finite numbers inside a trace: see `status`. Neglected: compliance, play,
    friction in the pins, the other foot's contact.
    """
    require_choice("outputs", outputs, OUTPUTS)
    model = prepare(params, fidelity=fidelity)
    if isinstance(model.inertia, ExactInertia):  # one instant: only here must the linkage close
        closes = closing_margin(model.inertia.params, jnp.asarray(theta)) >= 0
        model = rebuilt(model, closes=closes)
    theta, crank_rate, foot_velocity, torque, mu_static, mu_kinetic = _floats(
        model, theta, crank_rate, foot_velocity, torque, mu_static, mu_kinetic
    )
    scene = Scene(Uniform(mu_static, mu_kinetic))
    system = System(model, scene, Torque(torque), duration=jnp.zeros_like(theta))
    friction = Friction(mu_static, mu_kinetic)
    return at_instant(system, friction, theta, crank_rate, foot_velocity, outputs)


def _floats(tree: object, *values: Number) -> list[Array]:
    """The values as arrays of the widest floating type among them and the tree."""
    dtype = float_type(tree, values)
    return [jnp.asarray(value, dtype) for value in values]
