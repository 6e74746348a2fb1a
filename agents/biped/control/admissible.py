"""Torques under which the foot keeps within a friction cone and its own edges."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax.numpy as jnp

from stickslip.dynamics.biped.contact import ankle_moment

if TYPE_CHECKING:
    from jax.typing import ArrayLike
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedModel, BipedState
    from stickslip.dynamics.biped.contact import Motion


def admissible(
    robot: BipedModel,
    biped: BipedState,
    idle: Motion,
    driven: Motion,
    friction: ArrayLike,
    footing: ArrayLike,
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Least and greatest torque [N m] for which |f| <= friction x N and the zero-moment point is
    within `footing` of the way to heel and toe, the foot at rest.

    idle, driven: its motion under no torque and under 1 N m; all is linear in between.
    """

    def excess(motion: Motion):
        """Not positive where a motion is allowed: friction both ways, toe, heel."""
        f, N = motion.friction_force, motion.normal_force
        at = robot.inertia.moment_at(biped.phase)
        alpha, a1 = motion.crank_acceleration, motion.foot_acceleration
        moment = ankle_moment(robot, at, biped.crank_rate, alpha, a1)
        toe, heel = footing * robot.toe * N, footing * robot.heel * N
        cone = friction * N
        return jnp.stack([f - cone, -f - cone, moment - toe, -moment - heel])

    base = excess(idle)
    slope = excess(driven) - base
    bound = -base / jnp.where(slope == 0, 1.0, slope)
    highest = jnp.min(jnp.where(slope > 0, bound, jnp.inf))
    lowest = jnp.minimum(jnp.max(jnp.where(slope < 0, bound, -jnp.inf)), highest)
    return lowest, highest
