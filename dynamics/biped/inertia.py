"""M, P, Y of MODEL 1.4 and the ground's moment, exact: functions of the crank angle alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import LINK_OF_BODY, centres_and_angles
from stickslip.dynamics.numeric import Number, float_type
from stickslip.dynamics.pytrees import register_pytree

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Real

    from stickslip.dynamics.biped.params import BipedParams


class ReducedInertia(NamedTuple):
    """M, P, Y of MODEL 1.4 and their derivatives by the crank angle; all depend on it alone."""

    M: Float[Array, ""]
    """sum m (X'^2 + y'^2) + I phi'^2 [kg m^2]"""
    dM: Float[Array, ""]
    P: Float[Array, ""]
    """sum m X' [kg m]"""
    dP: Float[Array, ""]
    Y: Float[Array, ""]
    """sum m y' [kg m]; gravity times Y is the slope of the potential energy"""
    dY: Float[Array, ""]

    @property
    def P_crank(self) -> Float[Array, ""]:
        """Coefficient of a1 in the crank's equation: P, since derivatives are exact."""
        return self.P

    @property
    def Y_crank(self) -> Float[Array, ""]:
        """Coefficient of gravity in the crank's equation: Y."""
        return self.Y


class GroundMoment(NamedTuple):
    """Terms of the ground's moment about the ankle (eq. 30)."""

    L: Float[Array, ""]
    """Angular momentum about the ankle per crank rate: sum m (X y' - y X') + I phi' [kg m^2]"""
    dL: Float[Array, ""]
    X: Float[Array, ""]
    """sum m X [kg m]"""
    Y: Float[Array, ""]
    """sum m y [kg m]"""


def reduced_inertia(params: BipedParams, theta: Real[Number, ""]) -> ReducedInertia:
    """M, dM, P, dP, Y, dY at crank angle `theta` [rad] of the supporting leg (MODEL 1.4).

    Exact: forward-mode differentiation of the kinematics, where the chapter's eqs. (23)-(25) take
    forward differences. Scalars: batch with vmap.
    """
    return inertia_and_moment(params, theta)[0]


def ground_moment(params: BipedParams, theta: Real[Number, ""]) -> GroundMoment:
    """L, dL and the first mass moments about the supporting ankle, at crank angle `theta` [rad]."""
    return inertia_and_moment(params, theta)[1]


def inertia_and_moment(
    params: BipedParams, theta: Real[Number, ""]
) -> tuple[ReducedInertia, GroundMoment]:
    """`reduced_inertia` and `ground_moment` in one program half as large as the two."""
    if jnp.issubdtype(jnp.result_type(theta), jnp.integer):
        theta = jnp.asarray(theta, float_type(params))
    (M, P, Y, L), (dM, dP, dY, dL), centres = jax.jvp(
        lambda angle: _momenta(params, angle), (theta,), (jnp.ones_like(theta),), has_aux=True
    )
    X, height = jnp.sum(body_masses(params)[:, None] * centres, axis=0)
    return ReducedInertia(M, dM, P, dP, Y, dY), GroundMoment(L, dL, X, height)


def body_masses(params: BipedParams) -> Float[Array, " 24"]:
    """Masses of the 24 bodies in the order of BODIES [kg], the payload on the hip."""
    mass = jnp.asarray(params.mass)
    at_hip = np.arange(mass.shape[-1]) == 12
    return jnp.where(at_hip, mass + params.payload, mass)[LINK_OF_BODY]


def _momenta(
    params: BipedParams, theta: Float[Array, ""]
) -> tuple[tuple[Float[Array, ""], ...], Float[Array, "24 2"]]:
    """Generalised momenta per unit crank rate, M, P, Y, L, and the centres of mass [m]."""

    (centres, _), (velocity, turning) = jax.jvp(
        lambda angle: centres_and_angles(params, angle), (theta,), (jnp.ones_like(theta),)
    )
    mass, inertia = body_masses(params), jnp.asarray(params.inertia)[LINK_OF_BODY]
    M = jnp.sum(mass * jnp.sum(velocity**2, axis=-1)) + jnp.sum(inertia * turning**2)
    P, Y = jnp.sum(mass[:, None] * velocity, axis=0)
    spin = centres[:, 0] * velocity[:, 1] - centres[:, 1] * velocity[:, 0]
    L = jnp.sum(mass * spin) + jnp.sum(inertia * turning)
    return (M, P, Y, L), centres


@register_pytree
@dataclass(frozen=True)
class ExactInertia:
    """The reference: exact functions of the crank angle, from the linkage at every call."""

    params: BipedParams

    def at(self, theta: Float[Array, ""]) -> ReducedInertia:
        """M, P, Y and slopes at `theta` [rad]."""
        return reduced_inertia(self.params, theta)

    def moment_at(self, theta: Float[Array, ""]) -> GroundMoment:
        """Terms of the ground's moment about the ankle at `theta` [rad]."""
        return ground_moment(self.params, theta)

    def spin_at(self, theta: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """L and its slope alone, at `theta` [rad]."""
        return ground_moment(self.params, theta)[:2]
