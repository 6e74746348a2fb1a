"""The chapter's five Newton-Euler systems: all joint forces, the motor's torque, the ground's force.

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
import numpy as np

from stickslip.dynamics.biped.body_equations import (
    ALPHA,
    FOOT,
    GRAVITY,
    SLIDE,
    SQUARE,
    BodyEquations,
    body_equations,
)
from stickslip.dynamics.biped.contact import zero_moment_point
from stickslip.dynamics.biped.joint_solvers import (
    BLOCKS,
    DENSE,
    UnitSolutions,
    leg_matrices,
    solve_dense,
    unit_solutions,
)
from stickslip.dynamics.biped.joints import JOINT_FORCES
from stickslip.dynamics.biped.link_motion import LinkMotion, link_motion
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.numeric import Numeric, float_type

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams

GIVEN = {
    "inverse": ("crank_acceleration", "foot_acceleration"),
    "inverse_ground": ("crank_acceleration", "foot_acceleration"),
    "inverse_slip": ("crank_acceleration", "mu_kinetic", "direction"),
    "forward_stick": ("torque",),
    "forward_slip": ("torque", "mu_kinetic", "direction"),
}
"""What each system is given beside angle and rate; foot_acceleration may be left out (0)."""

SYSTEMS = tuple(GIVEN)
"""Accepted names of the chapter's systems."""

SOLVERS = (*DENSE, *BLOCKS)
"""Accepted names: "lu" as it stands; "scaled" by the crank's length, the weight and each row's
largest entry; "refined": scaled, and one step of iterative refinement; "block": each leg's 33
equations by themselves; "groups": each leg's Assur groups, one after the other."""

_TORQUE, _FRICTION, _NORMAL, _ALPHA, _SLIDE = range(len(JOINT_FORCES), len(JOINT_FORCES) + 5)
_COLUMNS = {
    "inverse": (_TORQUE,),
    "inverse_ground": (_TORQUE, _FRICTION, _NORMAL),
    "inverse_slip": (_TORQUE, _FRICTION, _NORMAL, _SLIDE),
    "forward_stick": (_FRICTION, _NORMAL, _ALPHA),
    "forward_slip": (_FRICTION, _NORMAL, _ALPHA, _SLIDE),
}


class NewtonEuler(NamedTuple):
    """Forces and accelerations of one instant; what was given is passed through."""

    joint_forces: Float[Array, " 68"]
    """In the order of JOINT_FORCES [N]."""
    torque: Float[Array, ""]
    """Motor torque between hip and crank [N m]."""
    friction_force: Float[Array, ""] | None
    """Of the ground on the foot, forwards [N]; None in "inverse", like the next three."""
    normal_force: Float[Array, ""] | None
    """Of the ground on the foot, upwards [N]."""
    zmp: Float[Array, ""] | None
    """Zero-moment point from the ankle, forwards [m]."""
    ankle_moment: Float[Array, ""] | None
    """Of the ground's force about the ankle, anticlockwise [N m] (eq. 30)."""
    crank_acceleration: Float[Array, ""]
    """[rad/s^2]"""
    foot_acceleration: Float[Array, ""]
    """[m/s^2]"""


def newton_euler(
    params: BipedParams,
    theta: Float[Array, ""],
    crank_rate: Float[Array, ""],
    *,
    system: str,
    torque: Numeric = None,
    crank_acceleration: Numeric = None,
    foot_acceleration: Numeric = None,
    mu_kinetic: Numeric = None,
    direction: Numeric = None,
    solver: str = "groups",
    difference_step: float | None = None,
) -> NewtonEuler:
    """Solve one of the chapter's systems (eqs. 19, 28, 31, 34, 36) for an instant.

    theta [rad] of the supporting leg, crank_rate [rad/s]; torque [N m], accelerations [rad/s^2],
    [m/s^2]; direction +1 slides forwards, -1 backwards, so that f = -direction mu_k N. Which of
    them a system takes: GIVEN. system, solver and difference_step (None exact; the chapter's D
    [rad]) are static. Scalars: batch with vmap. Raises ValueError for unknown names, and for what
    is missing or too much. Past the linkage's or the friction's bounds (dead position, Painleve)
    numbers are what the equations say, possibly infinite. Neglected: friction in pins and slots.
    """
    require_choice("system", system, SYSTEMS)
    require_choice("solver", solver, SOLVERS)
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
    if solver in DENSE:
        return _whole(params, equations, system, solver, crank_rate, known)
    units = unit_solutions(equations, motion, params.crank, solver)
    return _by_units(units, system, crank_rate, params.gravity, known)


def condition_number(
    params: BipedParams,
    theta: Float[Array, ""],
    *,
    system: str = "inverse_ground",
    solver: str = "lu",
    mu_kinetic: Numeric = 0.0,
    direction: Numeric = 1.0,
    difference_step: float | None = None,
) -> Float[Array, ""]:
    """Condition number (2-norm) of the matrix that a solver factors, at crank angle `theta` [rad].

    "lu": the system in SI units. "scaled", "refined": after scaling. "block": the worse of the two
    legs' matrices, which no system changes. Infinite where the linkage is in a dead position.
    "groups" factors no matrix and is refused.
    """
    require_choice("system", system, SYSTEMS)
    require_choice("solver", solver, (*DENSE, "block"))
    dtype = float_type(params, theta)
    params = params.astype(dtype)
    motion = link_motion(params, jnp.asarray(theta, dtype), difference_step)
    equations = body_equations(params, motion)
    if solver == "block":
        return jnp.max(jnp.linalg.cond(leg_matrices(equations, params.crank)))
    signed = jnp.asarray(mu_kinetic, dtype) * jnp.asarray(direction, dtype)
    matrix, _ = _system(equations, system, signed)
    if solver != "lu":
        matrix, *_ = _scaled(params, matrix, system)
    return jnp.linalg.cond(matrix)


def _require_given(system: str, values: dict) -> None:
    needed = GIVEN[system]
    missing = [name for name in needed if name not in values and name != "foot_acceleration"]
    extra = [name for name in values if name not in needed]
    if missing or extra:
        wrong = [f"{name} is missing" for name in missing] + [f"{name} is given" for name in extra]
        raise ValueError(f"system {system!r}: {', '.join(wrong)}; accepted: {', '.join(needed)}")


def _rows(system: str) -> np.ndarray:
    """Rows of the 72 body equations that belong to a system: all but the foot's moment, or foot."""
    foot = 3 * FOOT + np.arange(3)
    left_out = foot if system == "inverse" else foot[2:]
    return np.delete(np.arange(72), left_out).astype(np.int32)


def _system(equations: BodyEquations, system: str, signed_mu):
    """A system's matrix, and the columns of all that is known: [n, n], [n, 73]."""
    loads = equations.loads
    parts = [
        equations.forces,
        equations.torque[..., None],
        equations.ground[..., :2],
        -loads[..., ALPHA, None],
        -loads[..., SLIDE, None],
    ]
    matrix = jnp.concatenate(parts, axis=-1).reshape(72, -1)[_rows(system)]
    if system.endswith("slip"):
        zero = jnp.zeros(matrix.shape[1], matrix.dtype)
        matrix = jnp.concatenate(
            [matrix, zero.at[_FRICTION].set(1).at[_NORMAL].set(signed_mu)[None]]
        )
    unknown = (*range(len(JOINT_FORCES)), *_COLUMNS[system])
    return matrix[:, np.array(unknown, np.int32)], matrix


def _scaled(params: BipedParams, matrix, system: str):
    """The matrix in crank lengths and weights, rows of largest entry 1; row and column scales."""
    length, weight = params.crank, params.total_mass * params.gravity
    one = jnp.ones_like(length)
    units = [weight * length, weight, weight, params.gravity / length, params.gravity]
    force = jnp.stack([weight] * len(JOINT_FORCES))
    picked = [units[column - _TORQUE] for column in _COLUMNS[system]]
    columns = jnp.concatenate([force, jnp.stack(picked)])
    per_body = jnp.stack([one, one, length] * 24)[_rows(system)]
    rows = (
        weight * jnp.concatenate([per_body, jnp.stack([one] * (len(matrix) - len(per_body)))])
        if len(matrix) > len(per_body)
        else weight * per_body
    )
    scaled = matrix * columns / rows[:, None]
    largest = jnp.max(jnp.abs(scaled), axis=1)
    return scaled / largest[:, None], rows * largest, columns


def _whole(params, equations: BodyEquations, system: str, solver: str, rate, known) -> NewtonEuler:
    """By the system's whole matrix, as the chapter does."""
    square = rate**2
    matrix, everything = _system(equations, system, known["direction"] * known["mu_kinetic"])
    loads = equations.loads
    right = (loads[..., SQUARE] * square + loads[..., GRAVITY] * params.gravity).reshape(72)
    right = right[_rows(system)]
    right = jnp.concatenate([right, jnp.zeros(len(matrix) - len(right), right.dtype)])
    values = {
        _TORQUE: known.get("torque"),
        _ALPHA: known.get("crank_acceleration"),
        _SLIDE: known["foot_acceleration"],
    }
    values = {column: v for column, v in values.items() if column not in _COLUMNS[system]}
    for column, value in values.items():
        right = right - everything[:, column] * value
    if solver == "lu":
        solution = solve_dense(matrix, right, refine=False)
    else:
        scaled, rows, columns = _scaled(params, matrix, system)
        solution = columns * solve_dense(scaled, right / rows, refine=solver == "refined")
    forces = solution[: len(JOINT_FORCES)]
    values |= {column: solution[68 + i] for i, column in enumerate(_COLUMNS[system])}
    torque, alpha, a1 = values[_TORQUE], values[_ALPHA], values[_SLIDE]
    if system == "inverse":
        return NewtonEuler(forces, torque, None, None, None, None, alpha, a1)
    friction, normal = values[_FRICTION], values[_NORMAL]
    u = jnp.stack([alpha, square, a1, params.gravity])
    moment = loads[FOOT, 2] @ u - equations.forces[FOOT, 2] @ forces
    moment = moment - equations.ground[FOOT, 2, :2] @ jnp.stack([friction, normal])
    zmp = zero_moment_point(moment, normal)
    return NewtonEuler(forces, torque, friction, normal, zmp, moment, alpha, a1)


def _by_units(units: UnitSolutions, system: str, rate, gravity, known) -> NewtonEuler:
    """By unit solutions: torque row and Coulomb's law close the accelerations that are unknown."""
    square = rate**2
    signed = known["direction"] * known["mu_kinetic"]
    coulomb = units.ground[0] + signed * units.ground[1]  # 0 = coulomb @ (alpha, w^2, a1, g)
    alpha, a1 = known.get("crank_acceleration"), known["foot_acceleration"]

    def rest(row):
        return row[SQUARE] * square + row[GRAVITY] * gravity

    if system == "inverse_slip":
        a1 = -(rest(coulomb) + coulomb[ALPHA] * alpha) / coulomb[SLIDE]
    elif system == "forward_stick":
        alpha = (known["torque"] - rest(units.torque)) / units.torque[ALPHA]
    elif system == "forward_slip":
        drive, drag = known["torque"] - rest(units.torque), -rest(coulomb)
        M, P, Q, m = (row[c] for row in (units.torque, coulomb) for c in (ALPHA, SLIDE))
        alpha = (m * drive - P * drag) / (M * m - P * Q)
        a1 = (M * drag - Q * drive) / (M * m - P * Q)
    u = jnp.stack([alpha, square, a1, gravity])
    forces, torque = units.joint_forces @ u, known.get("torque")
    torque = units.torque @ u if torque is None else torque
    if system == "inverse":
        return NewtonEuler(forces, torque, None, None, None, None, alpha, a1)
    friction, normal, moment = units.ground @ u
    zmp = zero_moment_point(moment, normal)
    return NewtonEuler(forces, torque, friction, normal, zmp, moment, alpha, a1)
