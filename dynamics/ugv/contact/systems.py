"""The chapter's own systems: nine equations (40)-(42) and five (43), as matrices.

MODEL 2 says which slips of the pen are mended: the legs' and the body's weight in the second
subsystem is (m_w + 2 m_l + m_b) g, and the right side of the fourth of (43) is (C2E)_x m_w g.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.dynamics.ugv.contact.placed import Pose
from stickslip.dynamics.ugv.contact.wheel import cross
from stickslip.dynamics.ugv.params import UGVParams

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.numeric import Numeric
    from stickslip.dynamics.ugv.ground.shapes import Points, Values

SYSTEMS = ("closed", "five", "nine")


def solve_system(params: UGVParams, placed: Pose, system: str) -> tuple[Values, ...]:
    """F_rear, N_rear, F_front, N_front, torque from the five or the nine equations."""
    rows, right = (five if system == "five" else nine)(params, placed)
    solution = jnp.linalg.solve(rows, right[..., None])[..., 0]
    order = (0, 1, 2, 3, 4) if system == "five" else (0, 1, 2, 3, 8)
    return tuple(solution[..., i] for i in order)


def nine(params: UGVParams, placed: Pose) -> tuple[Float[Array, "... 9 9"], Float[Array, "... 9"]]:
    """Eqs. (40)-(42): [..., 9, 9] and [..., 9].

    Unknowns: F_r, N_r, F_f, N_f, F_lw (x, y; rear leg on rear wheel), F_wl (x, y; front wheel on
    front leg), M.
    """
    r, g = params.wheel_radius, params.gravity
    tr, nr, tf, nf, zero, one = _directions(placed)
    _, carried = second_subsystem(params, placed)
    _, mass = whole(params, placed)
    T2, E2, T3, D3 = _arms(params, placed)
    rows = [
        [tr[..., 0], nr[..., 0], zero, zero, one, zero, zero, zero, zero],
        [tr[..., 1], nr[..., 1], zero, zero, zero, one, zero, zero, zero],
        [zero + r, zero, zero, zero, zero, zero, zero, zero, one],
        [tr[..., 0], nr[..., 0], zero, zero, zero, zero, one, zero, zero],
        [tr[..., 1], nr[..., 1], zero, zero, zero, zero, zero, one, zero],
        [cross(T2, tr), cross(T2, nr), zero, zero, zero, zero, -E2[..., 1], E2[..., 0], -one],
        [tr[..., 0], nr[..., 0], tf[..., 0], nf[..., 0], zero, zero, zero, zero, zero],
        [tr[..., 1], nr[..., 1], tf[..., 1], nf[..., 1], zero, zero, zero, zero, zero],
        [cross(T3, tr), cross(T3, nr), cross(D3, tf), cross(D3, nf), zero, zero, zero, zero, zero],
    ]
    wheel = zero + params.wheel_mass * g
    right = [zero, wheel, zero, zero, zero + carried * g, zero, zero, zero + mass * g, zero]
    return _matrix(rows), jnp.stack(right, -1)


def five(params: UGVParams, placed: Pose) -> tuple[Float[Array, "... 5 5"], Float[Array, "... 5"]]:
    """Eq. (43), with F_f among its unknowns F_r, N_r, F_f, N_f, M: [..., 5, 5] and [..., 5]."""
    r, g = params.wheel_radius, params.gravity
    tr, nr, tf, nf, zero, one = _directions(placed)
    _, mass = whole(params, placed)
    T2, E2, T3, D3 = _arms(params, placed)
    rows = [
        [tr[..., 0], nr[..., 0], tf[..., 0], nf[..., 0], zero],
        [tr[..., 1], nr[..., 1], tf[..., 1], nf[..., 1], zero],
        [zero + r, zero, zero, zero, one],
        [cross(T2, tr), cross(T2, nr), cross(E2, tf), cross(E2, nf), -one],
        [cross(T3, tr), cross(T3, nr), cross(D3, tf), cross(D3, nf), zero],
    ]
    right = [zero, zero + mass * g, zero, E2[..., 0] * params.wheel_mass * g, zero]
    return _matrix(rows), jnp.stack(right, -1)


def second_subsystem(params: UGVParams, placed: Pose) -> tuple[Points, Numeric]:
    """Centre of mass [..., 2] and mass of rear wheel, legs and body (C2 of Fig. 23)."""
    mass = params.wheel_mass + 2 * params.leg_mass + params.body_mass
    moment = (
        params.wheel_mass * placed.rear.centre
        + params.leg_mass * (placed.rear_leg + placed.front_leg)
        + params.body_mass * placed.body
    )
    return moment / mass, mass


def whole(params: UGVParams, placed: Pose) -> tuple[Points, Numeric]:
    """Centre of mass [..., 2] and mass of the whole half vehicle (C3)."""
    carried, mass = second_subsystem(params, placed)
    total = mass + params.wheel_mass
    return (mass * carried + params.wheel_mass * placed.front.centre) / total, total


def _directions(placed: Pose) -> tuple[Points, Points, Points, Points, Values, Values]:
    """Tangents and normals at both contacts, [..., 2] each, and zeros and ones of their batch."""
    zero, one = jnp.zeros_like(placed.wheelbase), jnp.ones_like(placed.wheelbase)
    rear, front = placed.rear, placed.front
    return rear.tangent, rear.normal, front.tangent, front.normal, zero, one


def _arms(params: UGVParams, placed: Pose) -> tuple[Points, Points, Points, Points]:
    """The lever arms C2T, C2E, C3T and C3D of eqs. (41)-(43), [..., 2] each."""
    C2, _ = second_subsystem(params, placed)
    C3, _ = whole(params, placed)
    rear, front = placed.rear.point, placed.front.point
    return rear - C2, placed.front.centre - C2, rear - C3, front - C3


def _matrix(rows: list[list[Values]]) -> Float[Array, "... n n"]:
    return jnp.stack([jnp.stack(jnp.broadcast_arrays(*row), -1) for row in rows], -2)
