"""Stick, slip and the ground's force: the reduced equations of MODEL 1.4, forces at one instant.

Every caller (integrators, environments) solves the motion here. The mode is a number: 0 sticks, +1
slides forwards, -1 slides backwards.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.inertia import ExactInertia, inertia_and_moment
from stickslip.dynamics.biped.joints import JointInertia
from stickslip.dynamics.biped.links import closing_margin
from stickslip.dynamics.biped.model import BipedModel, loaded_params, prepare
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.pytrees import Number, all_finite, float_type, rebuilt
from stickslip.dynamics.scene import OUTPUTS, Floor, Grip, Patches, Scene, Uniform
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.biped.inertia import DifferencedInertia, GroundMoment, ReducedInertia
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.biped.settings import Fidelity
    from stickslip.dynamics.pytrees import Flag, Integer, Scalar

    Coefficients = ReducedInertia | DifferencedInertia


EDGE_ROUNDINGS = 64
"""A friction within so many roundings of the cone's edge is on it: it is computed no better."""
LIFTED = 1e-3
"""Share of the weight below which a foot lifts off, not topples. The zero-moment point leaves
every foot before the normal force is 0, one of 1e3 m at about 1e-4 of the weight."""


class Motion(NamedTuple):
    """Accelerations and ground force at one instant."""

    crank_acceleration: Scalar
    foot_acceleration: Scalar
    friction_force: Scalar
    normal_force: Scalar
    solvability: Scalar
    """> 0 where the motion has one solution; else (Painleve) the numbers are of sticking."""
    torque: Scalar
    """Torque of the motor, given or needed [N m]."""


def ground_force(
    model: BipedModel | BipedParams,
    inertia: Coefficients,
    square: Scalar,
    alpha: Scalar,
    a1: Scalar | None = None,
) -> tuple[Scalar, Scalar]:
    """Friction and normal force of a motion (MODEL 1.4); a1 None: the foot does not accelerate.

    square: of the crank rate [rad^2/s^2].
    """
    normal = model.total_mass * model.gravity + inertia.Y * alpha + inertia.dY * square
    friction = inertia.P * alpha + inertia.dP * square
    return friction if a1 is None else friction + model.total_mass * a1, normal


def motor_torque(
    model: BipedModel | BipedParams,
    inertia: Coefficients,
    crank_rate: Scalar,
    alpha: Scalar,
    a1: Scalar,
) -> Scalar:
    """Torque that a motion needs (MODEL 1.4)."""
    accelerating = inertia.M * alpha + inertia.P_crank * a1
    return accelerating + inertia.dM * crank_rate**2 / 2 + model.gravity * inertia.Y_crank


def sticking(model: BipedModel, inertia: Coefficients, square: Scalar, torque: Scalar) -> Motion:
    """The foot at rest (a1 = 0): alpha from the crank equation, then f and N (MODEL 1.4).

    square: of the crank rate [rad^2/s^2].
    """
    net_torque = torque - inertia.dM * square / 2 - model.gravity * inertia.Y_crank
    alpha = net_torque / inertia.M
    friction, normal = ground_force(model, inertia, square, alpha)
    zero, one = jnp.zeros_like(alpha), jnp.ones_like(alpha)
    return Motion(alpha, zero, friction, normal, one, torque)


def moving(
    model: BipedModel,
    inertia: Coefficients,
    crank_rate: Scalar,
    torque: Scalar,
    mode: Scalar,
    mu_kinetic: Scalar,
) -> Motion:
    """The motion in a given mode: f = -mode mu_k N with both accelerations free, or sticking.

    Sliding is solvable while M m - P (P + mode mu_k Y) > 0; past that bound (Painleve) the
    equations have no solution or two, and sticking's numbers stand in beside solvability <= 0.
    """
    M, P, P_crank = inertia.M, inertia.P, inertia.P_crank
    mass, square = model.total_mass, crank_rate**2
    slides = mode != 0
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
    friction, normal = ground_force(model, inertia, square, alpha)
    friction = jnp.where(slides, -signed * normal, friction)
    return Motion(alpha, a1, friction, normal, solvability, torque)


def prescribed(
    model: BipedModel,
    inertia: Coefficients,
    crank_rate: Scalar,
    alpha: Scalar,
    mode: Scalar,
    mu_kinetic: Scalar,
) -> Motion:
    """A prescribed crank motion, its foot in a given mode: eq. (31) at rest, eq. (34) sliding.

    The normal force is that of the crank's motion, so sliding always has one solution.
    """
    slides = mode != 0
    needed, normal = ground_force(model, inertia, crank_rate**2, alpha)
    friction = jnp.where(slides, -mode * mu_kinetic * normal, needed)
    a1 = jnp.where(slides, (friction - needed) / model.total_mass, 0.0)
    torque = motor_torque(model, inertia, crank_rate, alpha, a1)
    return Motion(alpha, a1, friction, normal, jnp.ones_like(alpha), torque)


def mode_of(still: Motion, foot_velocity: Scalar, mu_static: Scalar) -> Scalar:
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
    square: Scalar,
    crank_acceleration: Scalar,
    foot_acceleration: Scalar,
) -> Scalar:
    """Moment of the ground's force about the ankle [N m] (eq. 30); square: of the crank rate."""
    turning = moment.L * crank_acceleration + moment.dL * square
    return turning + robot.gravity * moment.X - foot_acceleration * moment.Y


def fall_under(model: BipedModel, normal_force: Scalar) -> Integer:
    """TOPPLE, or LIFT_OFF: the Status where the zero-moment point leaves the foot."""
    loaded = normal_force > LIFTED * model.total_mass * model.gravity
    return jnp.where(loaded, Status.TOPPLE, Status.LIFT_OFF)


def zero_moment_point(moment_of_ground: Scalar, normal_force: Scalar) -> Scalar:
    """Zero-moment point, from the ankle forwards [m]; 0 where there is no force."""
    pressed = normal_force > 0
    return jnp.where(pressed, moment_of_ground / jnp.where(pressed, normal_force, 1.0), 0.0)


class Friction(NamedTuple):
    """Friction coefficients [-] where the foot stands."""

    mu_static: Scalar
    mu_kinetic: Scalar


def patch_at(floor: Floor, position: Scalar, direction: Scalar) -> Integer:
    """Index of the patch under a floor position [m]; on an edge, the one it moves into."""
    if not isinstance(floor, Patches):
        return jnp.zeros_like(position, jnp.int32)
    edges = jnp.asarray(floor.edges)
    passed = (edges < position) | ((edges == position) & (direction >= 0))
    return jnp.sum(passed, dtype=jnp.int32)


def friction_on(floor: Uniform | Patches, patch: Integer, dtype: DTypeLike) -> Friction:
    """The coefficients on one patch."""
    kinetic = jnp.asarray(floor.mu_kinetic, dtype)
    static = jnp.asarray(floor.mu_static, dtype)
    if isinstance(floor, Uniform):
        return Friction(static, kinetic)
    return Friction(static[patch], kinetic[patch])


def edge_ahead(floor: Patches, patch: Integer, direction: Scalar, dtype: DTypeLike) -> Scalar:
    """Floor position of the edge the foot moves towards [m]; infinite past the outermost."""
    edges = jnp.asarray(floor.edges, dtype)
    infinite = jnp.full((1,), jnp.inf, dtype)
    bounds = jnp.concatenate([-infinite, edges, infinite])
    return bounds[jnp.where(direction >= 0, patch + 1, patch)]


class Torque(NamedTuple):
    """The motor's torque is given, as far as it has the power for it: |torque x crank rate|."""

    torque: Scalar
    max_power: Scalar | None = None
    """[W]; None: any."""

    def at(self, crank_rate: Scalar) -> Scalar:
        """The torque at a crank rate [N m]."""
        if self.max_power is None:
            return self.torque
        most = self.max_power / jnp.maximum(jnp.abs(crank_rate), jnp.finfo(crank_rate.dtype).tiny)
        return jnp.clip(self.torque, -most, most)


class CrankMotion(NamedTuple):
    """The crank's acceleration is given; the motor's torque follows from it."""

    crank_acceleration: Scalar


Drive = Torque | CrankMotion


def torque_held(drive: Drive) -> Scalar | None:
    """The motor's torque where it is the same at every crank rate [N m]; else None."""
    return drive.torque if isinstance(drive, Torque) and drive.max_power is None else None


class System(NamedTuple):
    """Constants of one call; an instant has no duration [s]."""

    model: BipedModel
    scene: Scene
    drive: Drive
    duration: Array
    max_rate: Array | None = None
    """Crank rate beyond which a walk ends as a RUNAWAY [rad/s]; None: no such end."""

    def friction(self, patch: Integer) -> Friction | None:
        """The coefficients on one patch; None on a floor without slip."""
        floor = self.scene.floor
        return None if isinstance(floor, Grip) else friction_on(floor, patch, self.duration.dtype)

    def still(self, inertia: Coefficients, crank_rate: Scalar) -> Motion:
        """The motion with the foot held at rest."""
        drive, zero = self.drive, jnp.zeros_like(crank_rate)
        if not isinstance(drive, CrankMotion):
            return sticking(self.model, inertia, crank_rate**2, drive.at(crank_rate))
        return prescribed(self.model, inertia, crank_rate, drive.crank_acceleration, zero, zero)

    def motion(
        self, friction: Friction | None, mode: Scalar, inertia: Coefficients, crank_rate: Scalar
    ) -> Motion:
        """The motion in a mode; friction None: the foot cannot slip."""
        if friction is None:
            return self.still(inertia, crank_rate)
        model, drive, law = self.model, self.drive, (mode, friction.mu_kinetic)
        if not isinstance(drive, CrankMotion):
            return moving(model, inertia, crank_rate, drive.at(crank_rate), *law)
        return prescribed(model, inertia, crank_rate, drive.crank_acceleration, *law)

    def tiny(self):
        """A time too short to matter in the working precision [s]."""
        return 8 * jnp.finfo(self.duration.dtype).eps * self.duration


class ForwardDynamics(NamedTuple):
    """Accelerations and forces under a torque at one instant."""

    crank_acceleration: Scalar
    """[rad/s^2]"""
    foot_acceleration: Scalar
    """[m/s^2]"""
    friction_force: Scalar
    """Friction force on the foot, forwards [N]."""
    normal_force: Scalar
    """Normal force on the foot, upwards [N]."""
    zmp: Scalar | None
    """Zero-moment point from the ankle, forwards [m]; None with outputs="state"."""
    mode: Integer
    """0 sticks, +1 slides forwards, -1 slides backwards."""
    status: Integer
    """A Status: ok, slip onset (at rest but outside the cone), topple, lift-off, ..."""
    joint_forces: Float[Array, " 68"] | None = None
    """Joint forces in the order of JOINT_FORCES [N] with outputs="joints"."""
    torque: Scalar | None = None
    """Torque of the motor, given or needed [N m]."""


def at_instant(
    system: System,
    friction: Friction | None,
    theta: Scalar,
    crank_rate: Scalar,
    foot_velocity: Scalar,
    outputs: str = "forces",
) -> ForwardDynamics:
    """Mode, motion and the requested `outputs`; friction None: the foot cannot slip."""
    model = system.model
    inertia = model.inertia.at(theta)
    motion = system.still(inertia, crank_rate)
    mode = jnp.zeros_like(motion.crank_acceleration)
    onset = jnp.zeros_like(mode, bool)
    if friction is not None:
        mode = mode_of(motion, foot_velocity, friction.mu_static)
        motion = system.motion(friction, mode, inertia, crank_rate)
        onset = (foot_velocity == 0) & (mode != 0)
    zmp, joints = None, None
    accelerations = motion.crank_acceleration, motion.foot_acceleration
    if outputs != "state":
        moment = ankle_moment(model, model.inertia.moment_at(theta), crank_rate**2, *accelerations)
        zmp = zero_moment_point(moment, motion.normal_force)
    if outputs == "joints":
        joints = JointInertia(loaded_params(model)).joint_forces(theta, crank_rate, *accelerations)
    numbers = (theta, crank_rate, foot_velocity, system.drive, friction)
    numbers += (*accelerations, motion.friction_force, motion.normal_force, zmp, joints)
    status = _status(model, motion, zmp, onset, numbers)
    return ForwardDynamics(*motion[:4], zmp, mode.astype(jnp.int32), status, joints, motion.torque)


def _status(
    model: BipedModel, motion: Motion, zmp: Scalar | None, onset: Flag, numbers: tuple[object, ...]
) -> Integer:
    """The Status of one instant, the gravest status last. zmp None: toppling is not checked;
    numbers: all that was given and all that came out."""
    status = jnp.where(onset, Status.SLIP_ONSET, Status.OK)
    if zmp is not None:
        off_foot = (zmp > model.toe) | (zmp < -model.heel)
        status = jnp.where(off_foot, fall_under(model, motion.normal_force), status)
    status = jnp.where(motion.normal_force <= 0, Status.LIFT_OFF, status)
    status = jnp.where((motion.solvability > 0) & model.closes, status, Status.NO_SOLUTION)
    return jnp.where(all_finite(numbers), status, Status.NON_FINITE).astype(jnp.int32)


class InverseDynamics(NamedTuple):
    """Torque and forces of a prescribed motion; forces on the foot, ground frame."""

    torque: Scalar
    """Motor torque between hip and crank [N m]."""
    friction_force: Scalar
    normal_force: Scalar
    zmp: Scalar
    """Zero-moment point from the ankle, forwards [m]."""
    joint_forces: Any
    """Joint forces [68] in the order of JOINT_FORCES [N] with outputs="joints"; else None."""
    status: Integer
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
    friction, normal = ground_force(params, inertia, crank_rate**2, alpha, a1)
    zmp = zero_moment_point(ankle_moment(params, at, crank_rate**2, alpha, a1), normal)
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
