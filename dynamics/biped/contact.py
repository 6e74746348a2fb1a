"""Stick, slip and the ground's force: the reduced equations of MODEL 1.4, once.

Every caller (forces at an instant, integrators, environments) solves the motion here. The mode is
a number: 0 sticks, +1 slides forwards, -1 slides backwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int

    from stickslip.dynamics.biped.bodies.joint_inertia import DifferencedInertia
    from stickslip.dynamics.biped.coefficients.inertia import GroundMoment, ReducedInertia
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.biped.params import BipedParams

    Coefficients = ReducedInertia | DifferencedInertia


EDGE_ROUNDINGS = 64
"""A friction within so many roundings of the cone's edge is on it: it is computed no better."""


LIFTED = 1e-3
"""Share of the weight below which a foot lifts off, not topples. The zero-moment point leaves
every foot before the normal force is 0, one of 1e3 m at about 1e-4 of the weight."""


class Motion(NamedTuple):
    """Accelerations and ground force at one instant."""

    crank_acceleration: Float[Array, ""]
    foot_acceleration: Float[Array, ""]
    friction_force: Float[Array, ""]
    normal_force: Float[Array, ""]
    solvability: Float[Array, ""]
    """> 0 where the motion has one solution; else (Painleve) the numbers are of sticking."""
    torque: Float[Array, ""]
    """Torque of the motor, given or needed [N m]."""


def ground_force(
    model: BipedModel | BipedParams,
    inertia: Coefficients,
    crank_rate: Float[Array, ""],
    alpha: Float[Array, ""],
    a1: Float[Array, ""] | None = None,
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Friction and normal force of a motion (MODEL 1.4); a1 None: the foot does not accelerate."""
    square = crank_rate**2
    normal = model.total_mass * model.gravity + inertia.Y * alpha + inertia.dY * square
    friction = inertia.P * alpha + inertia.dP * square
    return friction if a1 is None else friction + model.total_mass * a1, normal


def motor_torque(
    model: BipedModel | BipedParams,
    inertia: Coefficients,
    crank_rate: Float[Array, ""],
    alpha: Float[Array, ""],
    a1: Float[Array, ""],
) -> Float[Array, ""]:
    """Torque that a motion needs (MODEL 1.4)."""
    accelerating = inertia.M * alpha + inertia.P_crank * a1
    return accelerating + inertia.dM * crank_rate**2 / 2 + model.gravity * inertia.Y_crank


def sticking(
    model: BipedModel, inertia: Coefficients, crank_rate: Float[Array, ""], torque: Float[Array, ""]
) -> Motion:
    """The foot at rest (a1 = 0): alpha from the crank equation, then f and N (MODEL 1.4)."""
    net_torque = torque - inertia.dM * crank_rate**2 / 2 - model.gravity * inertia.Y_crank
    alpha = net_torque / inertia.M
    friction, normal = ground_force(model, inertia, crank_rate, alpha)
    zero, one = jnp.zeros_like(alpha), jnp.ones_like(alpha)
    return Motion(alpha, zero, friction, normal, one, torque)


def moving(
    model: BipedModel,
    inertia: Coefficients,
    crank_rate: Float[Array, ""],
    torque: Float[Array, ""],
    mode: Float[Array, ""],
    mu_kinetic: Float[Array, ""],
    slides: Bool[Array, ""] | None = None,
) -> Motion:
    """The motion in a given mode: f = -mode mu_k N with both accelerations free, or sticking.

    slides: whether it does, by default mode != 0; a friction law without rest always slides.
    Sliding is solvable while M m - P (P + mode mu_k Y) > 0; past that bound (Painleve) the
    equations have no solution or two, and sticking's numbers stand in beside solvability <= 0.
    """
    M, P, P_crank = inertia.M, inertia.P, inertia.P_crank
    mass, square = model.total_mass, crank_rate**2
    slides = (mode != 0) if slides is None else slides
    signed = mode * mu_kinetic
    net_torque = torque - inertia.dM * square / 2 - model.gravity * inertia.Y_crank
    drag = -inertia.dP * square - signed * (mass * model.gravity + inertia.dY * square)
    coupling = P + signed * inertia.Y
    determinant = M * mass - P_crank * coupling
    solvability = jnp.where(slides, determinant, 1.0)
    slides = slides & (determinant > 0)
    scale = 1 / jnp.where(slides, determinant, M)
    alpha = scale * jnp.where(slides, mass * net_torque - P_crank * drag, net_torque)
    a1 = jnp.where(slides, scale * (M * drag - coupling * net_torque), 0.0)
    friction, normal = ground_force(model, inertia, crank_rate, alpha)
    friction = jnp.where(slides, -signed * normal, friction)
    return Motion(alpha, a1, friction, normal, solvability, torque)


def prescribed(
    model: BipedModel,
    inertia: Coefficients,
    crank_rate: Float[Array, ""],
    alpha: Float[Array, ""],
    mode: Float[Array, ""],
    mu_kinetic: Float[Array, ""],
    slides: Bool[Array, ""] | None = None,
) -> Motion:
    """A prescribed crank motion, its foot in a given mode: eq. (31) at rest, eq. (34) sliding.

    The normal force is that of the crank's motion, so sliding always has one solution.
    """
    slides = (mode != 0) if slides is None else slides
    needed, normal = ground_force(model, inertia, crank_rate, alpha)
    friction = jnp.where(slides, -mode * mu_kinetic * normal, needed)
    a1 = jnp.where(slides, (friction - needed) / model.total_mass, 0.0)
    torque = motor_torque(model, inertia, crank_rate, alpha, a1)
    return Motion(alpha, a1, friction, normal, jnp.ones_like(alpha), torque)


def mode_of(
    still: Motion, foot_velocity: Float[Array, ""], mu_static: Float[Array, ""]
) -> Float[Array, ""]:
    """Contact mode: the velocity's direction, or at rest the friction cone's result (eq. 32).

    `still` is the sticking motion. A foot at rest whose friction would leave the cone slides
    against the force that would be needed to hold it. A few roundings beyond the cone still hold:
    a slide begun there would end within a rounding, and begin again.
    """
    slack = 1 + EDGE_ROUNDINGS * jnp.finfo(still.friction_force.dtype).eps
    within = jnp.abs(still.friction_force) <= mu_static * still.normal_force * slack
    at_rest = jnp.where(within, 0.0, -jnp.sign(still.friction_force))
    return jnp.where(foot_velocity != 0, jnp.sign(foot_velocity), at_rest)


def ankle_moment(
    robot: BipedModel | BipedParams,
    moment: GroundMoment,
    crank_rate: Float[Array, ""],
    crank_acceleration: Float[Array, ""],
    foot_acceleration: Float[Array, ""],
) -> Float[Array, ""]:
    """Moment of the ground's force about the ankle [N m], anticlockwise (eq. 30)."""
    turning = moment.L * crank_acceleration + moment.dL * crank_rate**2
    return turning + robot.gravity * moment.X - foot_acceleration * moment.Y


def fall_under(model: BipedModel, normal_force: Float[Array, ""]) -> Int[Array, ""]:
    """TOPPLE, or LIFT_OFF: the Status where the zero-moment point leaves the foot."""
    loaded = normal_force > LIFTED * model.total_mass * model.gravity
    return jnp.where(loaded, Status.TOPPLE, Status.LIFT_OFF)


def zero_moment_point(
    moment_of_ground: Float[Array, ""], normal_force: Float[Array, ""]
) -> Float[Array, ""]:
    """Zero-moment point, from the ankle forwards [m]; 0 where there is no force."""
    pressed = normal_force > 0
    return jnp.where(pressed, moment_of_ground / jnp.where(pressed, normal_force, 1.0), 0.0)
