"""The chapter's five Newton-Euler systems: joint forces, motor torque, ground force.

Unknowns, beside the 68 joint forces: the torque T, the ground's friction f and normal force N on
the foot, the crank acceleration alpha, the foot's acceleration a1. The foot's moment equation (30)
is left out and gives the ankle moment and the ZMP afterwards.

    system          equations                       unknowns             given
    inverse         19: 23 moving bodies            T                    alpha, a1
    inverse_ground  31: and the foot's x and y      T, f, N              alpha, a1
    inverse_slip    34: and f = -direction mu_k N   T, f, N, a1          alpha, mu_k, direction
    forward_stick   28: as 31                       f, N, alpha          T
    forward_slip    36: as 34                       f, N, alpha, a1      T, mu_k, direction

(34) prints mu_k / 2 and (36) gives its number twice; both are read as above.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.contact import zero_moment_point
from stickslip.dynamics.biped.joints.equations import (
    ALPHA,
    GRAVITY,
    SLIDE,
    SQUARE,
    body_equations,
    link_motion,
)
from stickslip.dynamics.biped.joints.inertia import UnitSolutions, solution_of, unit_solutions
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.numeric import Number, float_type

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.biped.params import BipedParams

GIVEN = {
    "inverse": ("crank_acceleration", "foot_acceleration"),
    "inverse_ground": ("crank_acceleration", "foot_acceleration"),
    "inverse_slip": ("crank_acceleration", "mu_kinetic", "direction"),
    "forward_stick": ("torque",),
    "forward_slip": ("torque", "mu_kinetic", "direction"),
}
"""Inputs of each system beside angle and rate; foot_acceleration may be left out (0)."""

SYSTEMS = tuple(GIVEN)
"""Accepted names of the chapter's systems."""


class NewtonEuler(NamedTuple):
    """Forces and accelerations of one instant; given ones are passed through."""

    joint_forces: Float[Array, " 68"]
    """Joint forces in the order of JOINT_FORCES [N]."""
    torque: Float[Array, ""]
    """Motor torque between hip and crank [N m]."""
    friction_force: Float[Array, ""] | None
    """Friction force on the foot, forwards [N]; None in "inverse", like the next three."""
    normal_force: Float[Array, ""] | None
    """Normal force on the foot, upwards [N]."""
    zmp: Float[Array, ""] | None
    """Zero-moment point from the ankle, forwards [m]."""
    ankle_moment: Float[Array, ""] | None
    """Moment of the ground's force about the ankle, anticlockwise [N m] (eq. 30)."""
    crank_acceleration: Float[Array, ""]
    """[rad/s^2]"""
    foot_acceleration: Float[Array, ""]
    """[m/s^2]"""


def newton_euler(
    params: BipedParams,
    theta: Real[Number, ""],
    crank_rate: Real[Number, ""],
    *,
    system: str,
    torque: Real[Number, ""] | None = None,
    crank_acceleration: Real[Number, ""] | None = None,
    foot_acceleration: Real[Number, ""] | None = None,
    mu_kinetic: Real[Number, ""] | None = None,
    direction: Real[Number, ""] | None = None,
    difference_step: float | None = None,
) -> NewtonEuler:
    """Solve one of the chapter's systems (eqs. 19, 28, 31, 34, 36) for an instant.

    theta [rad] of the supporting leg, crank_rate [rad/s]; torque [N m], accelerations [rad/s^2],
    [m/s^2]; direction +1 slides forwards, -1 backwards, so that f = -direction mu_k N. Which of
    them a system takes: GIVEN. system and difference_step (None exact; the chapter's D [rad]) are
    static. Solved leg by leg (joints/inertia.py). Scalars: batch with vmap. Raises ValueError for
    unknown names, and for what is missing or too much. Past the linkage's or the friction's bounds
    (dead position, Painleve) numbers are what the equations say, possibly infinite; a loop that
    cannot close gives no warning. Neglected: friction in pins and slots.
    """
    require_choice("system", system, SYSTEMS)
    values = {
        "torque": torque,
        "crank_acceleration": crank_acceleration,
        "foot_acceleration": foot_acceleration,
        "mu_kinetic": mu_kinetic,
        "direction": direction,
    }
    values = {name: value for name, value in values.items() if value is not None}
    _require_given(system, values)
    dtype = float_type(params, theta, crank_rate, values)
    params = params.astype(dtype)
    theta, crank_rate = jnp.asarray(theta, dtype), jnp.asarray(crank_rate, dtype)
    known = {name: jnp.asarray(0.0, dtype) for name in ("foot_acceleration", "mu_kinetic")}
    known |= {"direction": known["mu_kinetic"]}
    known |= {name: jnp.asarray(value, dtype) for name, value in values.items()}
    motion = link_motion(params, theta, difference_step)
    equations = body_equations(params, motion)
    alpha, a1 = known.get("crank_acceleration"), known["foot_acceleration"]
    if system not in ("inverse", "inverse_ground"):
        units = unit_solutions(equations, motion)
        alpha, a1 = _accelerations(units, system, crank_rate, params.gravity, known)
    u = jnp.stack([alpha, crank_rate**2, a1, params.gravity])
    forces, needed, (friction, normal, moment) = solution_of(equations, motion, u)
    torque = known.get("torque", needed)
    if system == "inverse":
        return NewtonEuler(forces, torque, None, None, None, None, alpha, a1)
    zmp = zero_moment_point(moment, normal)
    return NewtonEuler(forces, torque, friction, normal, zmp, moment, alpha, a1)


def _require_given(system: str, values: dict) -> None:
    needed = GIVEN[system]
    missing = [name for name in needed if name not in values and name != "foot_acceleration"]
    extra = [name for name in values if name not in needed]
    if missing or extra:
        wrong = [f"{name} is missing" for name in missing] + [f"{name} is given" for name in extra]
        raise ValueError(f"system {system!r}: {', '.join(wrong)}; accepted: {', '.join(needed)}")


def _accelerations(
    units: UnitSolutions,
    system: str,
    rate: Float[Array, ""],
    gravity: Float[Array, ""],
    known,
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Crank and foot acceleration, by the torque's row and Coulomb's law."""
    signed = known["direction"] * known["mu_kinetic"]
    coulomb = units.ground[0] + signed * units.ground[1]  # 0 = coulomb @ (alpha, w^2, a1, g)
    alpha, a1 = known.get("crank_acceleration"), known["foot_acceleration"]

    def rest(row: Float[Array, " columns"]) -> Float[Array, ""]:
        return row[SQUARE] * rate**2 + row[GRAVITY] * gravity

    if system == "inverse_slip":
        return alpha, -(rest(coulomb) + coulomb[ALPHA] * alpha) / coulomb[SLIDE]
    net_torque, drag = known["torque"] - rest(units.torque), -rest(coulomb)
    if system == "forward_stick":
        return net_torque / units.torque[ALPHA], a1
    M, P, Q, m = (row[c] for row in (units.torque, coulomb) for c in (ALPHA, SLIDE))
    determinant = M * m - P * Q
    return (m * net_torque - P * drag) / determinant, (M * drag - Q * net_torque) / determinant
