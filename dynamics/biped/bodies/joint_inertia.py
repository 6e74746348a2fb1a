"""The reduced equations' coefficients out of the full Newton-Euler system."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.bodies.body_equations import (
    ALPHA,
    GRAVITY,
    SLIDE,
    SQUARE,
    body_equations,
    ground_balance,
)
from stickslip.dynamics.biped.bodies.joint_solvers import (
    SOLVERS,
    UnitSolutions,
    solution_of,
    unit_solutions,
)
from stickslip.dynamics.biped.coefficients.inertia import GroundMoment, ReducedInertia
from stickslip.dynamics.biped.mechanism.link_motion import link_motion, require_difference_step
from stickslip.dynamics.checks import require_choice
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.bodies.body_equations import BodyEquations
    from stickslip.dynamics.biped.mechanism.link_motion import LinkMotion
    from stickslip.dynamics.biped.params import BipedParams


class DifferencedInertia(NamedTuple):
    """Coefficients when the links' motion is differenced: the crank's equation has its own.

    T = M alpha + P_crank a1 + dM w^2 / 2 + g Y_crank, f = P alpha + m a1 + dP w^2,
    N = m g + Y alpha + dY w^2. Exactly differentiated, P_crank = P and Y_crank = Y. Here the first
    two are the virtual power of the exact geometry, P and Y the differenced momenta.
    """

    M: Float[Array, ""]
    dM: Float[Array, ""]
    """Twice the coefficient of w^2 in the crank's equation."""
    P: Float[Array, ""]
    dP: Float[Array, ""]
    Y: Float[Array, ""]
    dY: Float[Array, ""]
    P_crank: Float[Array, ""]
    Y_crank: Float[Array, ""]


@register_pytree
@dataclass(frozen=True)
class JointInertia:
    """Inertia functions by solving the body equations for unit motions at every call.

    difference_step: None for exact motion of the links, or the chapter's D [rad] (eqs. 23-25).
    solver: out of SOLVERS. Both are static. Agrees with `reduced_inertia` to rounding when exact.
    """

    params: BipedParams
    difference_step: float | None = field(default=None, metadata={"static": True})
    solver: str = field(default="groups", metadata={"static": True})

    def __post_init__(self):
        require_choice("solver", self.solver, SOLVERS)
        if self.difference_step is not None:
            require_difference_step(self.difference_step)

    def at(self, theta: Float[Array, ""]) -> ReducedInertia | DifferencedInertia:
        """M, P, Y and slopes at `theta` [rad]; DifferencedInertia with a difference_step."""
        units = self.units(theta)
        torque, (friction, normal, _) = units.torque, units.ground
        six = ReducedInertia(
            M=torque[ALPHA],
            dM=2 * torque[SQUARE],
            P=friction[ALPHA],
            dP=friction[SQUARE],
            Y=normal[ALPHA],
            dY=normal[SQUARE],
        )
        if self.difference_step is None:
            return six
        return DifferencedInertia(*six, P_crank=torque[SLIDE], Y_crank=torque[GRAVITY])

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad] (eq. 30)."""
        motion, equations = self._equations(theta)
        moment = ground_balance(equations, motion)[2]
        return GroundMoment(moment[ALPHA], moment[SQUARE], moment[GRAVITY], -moment[SLIDE])

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        return self.moment_at(theta)[:2]

    def joint_forces(
        self,
        theta: Float[Array, ""],
        crank_rate: Float[Array, ""],
        crank_acceleration: Float[Array, ""],
        foot_acceleration: Float[Array, ""],
    ) -> Float[Array, " 68"]:
        """All joint forces [N] of a motion, in the order of JOINT_FORCES."""
        motion, equations = self._equations(theta)
        gravity = jnp.asarray(self.params.gravity, jnp.result_type(crank_rate))
        u = jnp.stack([crank_acceleration, crank_rate**2, foot_acceleration, gravity])
        return solution_of(self.params, equations, motion, self.solver, u).joint_forces

    def units(self, theta: Float[Array, ""]) -> UnitSolutions:
        """Joint forces, torque and ground force per unit of motion and gravity, at `theta`."""
        motion, equations = self._equations(theta)
        return unit_solutions(self.params, equations, motion, self.solver)

    def _equations(self, theta: Float[Array, ""]) -> tuple[LinkMotion, BodyEquations]:
        motion = link_motion(self.params, theta, self.difference_step)
        return motion, body_equations(self.params, motion)
