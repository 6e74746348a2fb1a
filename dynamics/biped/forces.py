"""Forces and accelerations at one instant: inverse and forward, by the reduced equations."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp

from stickslip.dynamics.biped.contact import (
    Motion,
    ankle_moment,
    mode_of,
    moving,
    sticking,
    zero_moment_point,
)
from stickslip.dynamics.biped.floor import Friction
from stickslip.dynamics.biped.inertia import ground_moment, reduced_inertia
from stickslip.dynamics.biped.kinematics import kinematics
from stickslip.dynamics.biped.model import BipedModel, Fidelity, prepare
from stickslip.dynamics.biped.table import ExactInertia
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.biped.params import BipedParams


class InverseDynamics(NamedTuple):
    """What a prescribed motion needs; forces on the foot, ground frame."""

    torque: Float[Array, ""]
    """Motor torque between hip and crank [N m]."""
    friction_force: Float[Array, ""]
    normal_force: Float[Array, ""]
    zmp: Float[Array, ""]
    """Zero-moment point from the ankle, forwards [m]."""


class ForwardDynamics(NamedTuple):
    """What a torque does at one instant."""

    crank_acceleration: Float[Array, ""]
    """[rad/s^2]"""
    foot_acceleration: Float[Array, ""]
    """[m/s^2]"""
    friction_force: Float[Array, ""]
    """Of the ground on the foot, forwards [N]."""
    normal_force: Float[Array, ""]
    """Of the ground on the foot, upwards [N]."""
    zmp: Float[Array, ""]
    """Zero-moment point from the ankle, forwards [m]."""
    mode: Int[Array, ""]
    """0 sticks, +1 slides forwards, -1 slides backwards."""
    status: Int[Array, ""]
    """A Status: ok, slip onset (at rest but outside the cone), topple, lift-off, ..."""


def inverse_dynamics(
    params: BipedParams,
    theta: Float[Array, ""],
    crank_rate: Float[Array, ""],
    crank_acceleration: Float[Array, ""],
    foot_velocity: Float[Array, ""] = 0.0,  # type: ignore[assignment]
    foot_acceleration: Float[Array, ""] = 0.0,  # type: ignore[assignment]
) -> InverseDynamics:
    """Torque and ground force of a prescribed motion (eqs. 18-19 and 30-31, reduced: MODEL 1.4).

    theta [rad] of the supporting leg, rates [rad/s, rad/s^2], foot [m/s, m/s^2]. No friction law:
    the force that the motion needs, whether the floor can give it or not. The foot's velocity does
    not enter (Galilei); it is an argument so that both dynamics take the same state. Exact.
    """
    theta, crank_rate, alpha, _, a1 = _floats(
        params, theta, crank_rate, crank_acceleration, foot_velocity, foot_acceleration
    )
    M, dM, P, dP, Y, dY = reduced_inertia(params, theta)
    square = crank_rate**2
    gravity, mass = params.gravity, params.total_mass
    torque = M * alpha + P * a1 + dM * square / 2 + gravity * Y
    friction = P * alpha + mass * a1 + dP * square
    normal = mass * gravity + Y * alpha + dY * square
    L, dL, X, height = ground_moment(params, theta)
    moment = L * alpha + dL * square + gravity * X - a1 * height
    return InverseDynamics(torque, friction, normal, zero_moment_point(moment, normal))


def forward_dynamics(
    params: BipedParams | BipedModel,
    theta: Float[Array, ""],
    crank_rate: Float[Array, ""],
    foot_velocity: Float[Array, ""],
    torque: Float[Array, ""],
    mu_static: Float[Array, ""],
    mu_kinetic: Float[Array, ""],
    *,
    fidelity: Fidelity = "reduced",
) -> ForwardDynamics:
    """Accelerations and ground force under a motor torque, with friction (MODEL 1.4, eqs. 26-36).

    theta [rad] of the supporting leg, crank_rate [rad/s], foot_velocity [m/s], torque [N m] of the
    motor on the crank. Foot at rest: sticks inside the static cone, else slides against the
    tendency. Scalars: batch with vmap. fidelity: see Fidelity. Never raises or returns NaN from
    finite numbers inside a trace: see `status`. Neglected: compliance, play, friction in the pins,
    the other foot's contact.
    """
    model = prepare(params, fidelity=fidelity)
    if isinstance(model.inertia, ExactInertia):  # one instant: only here must the linkage close
        closes = kinematics(model.inertia.params, jnp.asarray(theta)).closure >= 0
        model = replace(model, closes=closes)
    theta, crank_rate, foot_velocity, torque, mu_static, mu_kinetic = _floats(
        model, theta, crank_rate, foot_velocity, torque, mu_static, mu_kinetic
    )
    instant = at_instant(
        model, theta, crank_rate, foot_velocity, torque, Friction(mu_static, mu_kinetic)
    )
    return ForwardDynamics(
        *instant.motion[:4],
        zmp=instant.zmp,  # pyright: ignore[reportArgumentType]
        mode=instant.mode.astype(jnp.int32),
        status=instant.status,
    )


class Instant(NamedTuple):
    """Everything about one instant; zmp None where it is not asked for."""

    motion: Motion
    mode: Float[Array, ""]
    zmp: Float[Array, ""] | None
    status: Int[Array, ""]


def at_instant(
    model: BipedModel,
    theta,
    crank_rate,
    foot_velocity,
    torque,
    friction: Friction | None,
    with_zmp: bool = True,
) -> Instant:
    """Mode, motion, zero-moment point and status; friction None: the foot cannot slip."""
    inertia = model.inertia.at(theta)
    motion = sticking(model, inertia, crank_rate, torque)
    mode = jnp.zeros_like(motion.crank_acceleration)
    if friction is not None:
        mode = mode_of(motion, foot_velocity, friction.mu_static)
        motion = moving(model, inertia, crank_rate, torque, mode, friction.mu_kinetic)
    zmp = None
    if with_zmp:
        moment = ankle_moment(model, model.inertia.moment_at(theta), crank_rate, motion)
        zmp = zero_moment_point(moment, motion.normal_force)
    onset = (foot_velocity == 0) & (mode != 0)
    return Instant(motion, mode, zmp, _status(model, motion, zmp, onset))


def _status(model: BipedModel, motion: Motion, zmp, onset) -> Int[Array, ""]:
    """The Status of one instant, the gravest word last. zmp None: topple is not looked at."""
    status = jnp.where(onset, Status.SLIP_ONSET, Status.OK)
    if zmp is not None:
        off_foot = (zmp > model.toe) | (zmp < -model.heel)
        status = jnp.where(off_foot, Status.TOPPLE, status)
    status = jnp.where(motion.normal_force <= 0, Status.LIFT_OFF, status)
    status = jnp.where(motion.solvable & model.closes, status, Status.NO_SOLUTION)
    finite = jnp.isfinite(sum(motion[:4]))
    return jnp.where(finite, status, Status.NON_FINITE).astype(jnp.int32)


def _floats(tree, *values):
    """The values as arrays of one floating type: the widest among them and the tree."""
    types = (jnp.result_type(leaf) for leaf in jax.tree.leaves(tree))
    floating = (kind for kind in types if jnp.issubdtype(kind, jnp.floating))
    dtype = jnp.result_type(*values, *floating)
    return [jnp.asarray(value, dtype) for value in values]
