"""The chapter's systems as whole matrices (eqs. 19, 28, 31, 34, 36), plain or scaled."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import lu_factor, lu_solve

from stickslip.dynamics.biped.bodies.body_equations import ALPHA, FOOT, SLIDE, BodyEquations
from stickslip.dynamics.biped.links import BODIES
from stickslip.dynamics.biped.mechanism.joints import JOINT_FORCES

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Shaped

    from stickslip.dynamics.biped.params import BipedParams

WHOLE = ("lu", "scaled", "refined")
"""Solvers of a whole matrix: as it stands; by physical units and each row's largest entry; scaled,
with one step of iterative refinement in the same precision."""

TORQUE, FRICTION, NORMAL, CRANK_ACCELERATION, FOOT_ACCELERATION = range(
    len(JOINT_FORCES), len(JOINT_FORCES) + 5
)
"""Columns after the 68 joint forces."""

UNKNOWN = {
    "inverse": (TORQUE,),
    "inverse_ground": (TORQUE, FRICTION, NORMAL),
    "inverse_slip": (TORQUE, FRICTION, NORMAL, FOOT_ACCELERATION),
    "forward_stick": (FRICTION, NORMAL, CRANK_ACCELERATION),
    "forward_slip": (FRICTION, NORMAL, CRANK_ACCELERATION, FOOT_ACCELERATION),
}
"""Unknowns of each system beside the joint forces."""

_EQUATIONS = 3 * len(BODIES)


def all_columns(
    equations: BodyEquations, system: str, signed_mu: Float[Array, ""] | float
) -> Float[Array, "n 73"]:
    """A system's rows with a column for every quantity, unknown or given; [N, N m] by row.

    signed_mu: direction times mu_kinetic, for Coulomb's law f + signed_mu N = 0 as the last row of
    the slipping systems. The foot's moment equation is left out.
    """
    loads = equations.loads
    parts = [
        equations.forces,
        equations.torque[..., None],
        equations.ground[..., :2],
        -loads[..., ALPHA, None],
        -loads[..., SLIDE, None],
    ]
    rows = own_rows(jnp.concatenate(parts, axis=-1), system)
    if not _slips(system):
        return rows
    row = jnp.zeros(rows.shape[1], rows.dtype).at[FRICTION].set(1).at[NORMAL].set(signed_mu)
    return jnp.concatenate([rows, row[None]])


def own_rows(per_body: Shaped[Array, "24 3 *k"], system: str) -> Shaped[Array, "n *k"]:
    """The body equations that belong to a system: not the foot's moment, in "inverse" no foot."""
    foot = 3 * FOOT + np.arange(3)
    left_out = foot if system == "inverse" else foot[2:]
    rows = np.delete(np.arange(_EQUATIONS), left_out).astype(np.int32)
    return per_body.reshape(_EQUATIONS, *per_body.shape[2:])[rows]


def unknown_columns(columns: Float[Array, "n 73"], system: str) -> Float[Array, "n n"]:
    """The matrix of a system's unknowns."""
    kept = np.array([*range(len(JOINT_FORCES)), *UNKNOWN[system]], np.int32)
    return columns[:, kept]


def scaled_system(params: BipedParams, matrix: Float[Array, "n n"], system: str):
    """The matrix in crank lengths, weights and g, rows of largest entry 1; row and column scales.

    matrix = rows[:, None] * scaled / columns.
    """
    length, weight = jnp.asarray(params.crank), params.total_mass * params.gravity
    after = [weight * length, weight, weight, params.gravity / length, params.gravity]
    unknowns = [after[column - TORQUE] for column in UNKNOWN[system]]
    columns = jnp.concatenate([jnp.broadcast_to(weight, len(JOINT_FORCES)), jnp.stack(unknowns)])
    kinds = np.zeros((len(BODIES), 3), bool)
    kinds[:, 2] = True
    moments = own_rows(jnp.asarray(kinds), system)
    moments = jnp.concatenate([moments, jnp.zeros(len(matrix) - len(moments), bool)])
    rows = weight * jnp.where(moments, length, 1)
    scaled = matrix * columns / rows[:, None]
    largest = jnp.max(jnp.abs(scaled), axis=1)
    return scaled / largest[:, None], rows * largest, columns


def solve_whole(
    params: BipedParams,
    matrix: Float[Array, "n n"],
    right: Float[Array, "n k"],
    system: str,
    solver: str,
) -> Float[Array, "n k"]:
    """The unknowns, for one or more right sides; solver out of WHOLE."""
    if solver == "lu":
        return solve_dense(matrix, right)
    scaled, rows, columns = scaled_system(params, matrix, system)
    solution = solve_dense(scaled, right / rows[:, None], refine=solver == "refined")
    return columns[:, None] * solution


def solve_dense(
    matrix: Float[Array, "n n"], right: Float[Array, "n k"], *, refine: bool = False
) -> Float[Array, "n k"]:
    """LU with partial pivoting; refine: one step of iterative refinement in the same precision."""
    factors = lu_factor(matrix)
    solution = lu_solve(factors, right)
    if refine:
        solution = solution + lu_solve(factors, right - matrix @ solution)
    return solution


def foot_moment(
    equations: BodyEquations,
    loads: Float[Array, "*k"],
    joint_forces: Float[Array, "68 *k"],
    ground: Float[Array, "2 *k"],
) -> Float[Array, "*k"]:
    """The ground's moment about the ankle, by the foot's moment equation (30); trailing axes kept.

    loads: what the foot's third row is to sum to; joint_forces [68, ...]; ground [2, ...]: f, N.
    """
    pins = jnp.tensordot(equations.forces[FOOT, 2], joint_forces, 1)
    return loads - pins - jnp.tensordot(equations.ground[FOOT, 2, :2], ground, 1)


def _slips(system: str) -> bool:
    return FOOT_ACCELERATION in UNKNOWN[system]
