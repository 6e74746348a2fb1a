"""Motion of all links by the crank angle: exact, or by the chapter's forward differences.

Velocities and accelerations are these derivatives times the crank's (eqs. 17 and 20-22).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import LegPins, centres_and_angles, kinematics

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.params import BipedParams

    Places = tuple[Float[Array, "24 2"], Float[Array, " 24"]]


class LinkMotion(NamedTuple):
    """Positions of the 24 bodies and their derivatives by the crank angle; order of BODIES.

    Ground frame, origin at the supporting ankle; the slide x1 of eq. 16 is not included.
    """

    centres: Float[Array, "24 2"]
    """Centres of mass [m]."""
    centre_slopes: Float[Array, "24 2"]
    """Their first derivative X', y' [m/rad]."""
    centre_curvatures: Float[Array, "24 2"]
    """Their second derivative X'', y'' [m/rad^2]."""
    angles: Float[Array, " 24"]
    """Link angles [rad], modulo 2 pi."""
    angle_slopes: Float[Array, " 24"]
    angle_curvatures: Float[Array, " 24"]
    pins: LegPins
    """Pins of both legs, each [2, 2] m."""
    hip_pins: Float[Array, "3 2"]
    """A, B and D [m]."""


def link_motion(
    params: BipedParams, theta: Float[Array, ""], difference_step: float | None = None
) -> LinkMotion:
    """Motion of all links at crank angle `theta` [rad] of the supporting leg.

    difference_step None: exact, by differentiating the closed linkage forwards twice. A number D
    [rad]: the chapter's forward differences. Positions are exact at `theta` either way. Static
    choice; scalars, batch with vmap.
    """
    if difference_step is None:
        return exact_motion(params, theta)
    return differenced_motion(params, theta, difference_step)


def exact_motion(params: BipedParams, theta: Float[Array, ""]) -> LinkMotion:
    """Derivatives of the kinematics by forward-mode differentiation, to rounding."""
    one = jnp.ones_like(theta)

    def slope(angle: Float[Array, ""]):
        return jax.jvp(lambda at: centres_and_angles(params, at), (angle,), (one,))

    (places, slopes), (_, curvatures) = jax.jvp(slope, (theta,), (one,))
    return _motion(params, theta, places, slopes, curvatures)


def differenced_motion(params: BipedParams, theta: Float[Array, ""], step: float) -> LinkMotion:
    """Eqs. (23)-(25) with D = `step` [rad], first order in D.

    q' = (q(theta + D) - q(theta)) / D and q'' = (q(theta + 2D) - 2 q(theta + D) + q(theta)) / D^2;
    the chapter prints q(theta) for q(theta + D) in the second. Rounding adds about eps/D^2 to q'':
    in single precision more than 10 % of it at D = 1e-3.
    """
    require_difference_step(step)
    now, ahead, further = (centres_and_angles(params, theta + shift * step) for shift in (0, 1, 2))
    first = jax.tree.map(_change, now, ahead)
    second = jax.tree.map(_change, ahead, further)
    slopes = jax.tree.map(lambda change: change / step, first)
    curvatures = jax.tree.map(lambda a, b: (b - a) / step**2, first, second)
    return _motion(params, theta, now, slopes, curvatures)


def require_difference_step(step: float) -> None:
    """Raise ValueError unless `step` is a number in (0, 0.5] rad."""
    number = isinstance(step, int | float | np.number) and not isinstance(step, bool)
    if not number or not 0.0 < float(step) <= 0.5:
        raise ValueError(
            f"difference_step = {step!r}; accepted: None (exact) or a crank angle in (0, 0.5] rad"
        )


def _change(before: Float[Array, "..."], after: Float[Array, "..."]) -> Float[Array, "..."]:
    """after - before; angles, the array of rank 1, by the shorter way round."""
    change = after - before
    if change.ndim > 1:
        return change
    return change - 2 * np.pi * jnp.round(change / (2 * np.pi))


def _motion(
    params: BipedParams, theta: Float[Array, ""], places: Places, slopes: Places, curvatures: Places
) -> LinkMotion:
    now = kinematics(params, theta)
    (centres, angles), (d_centres, d_angles), (dd_centres, dd_angles) = places, slopes, curvatures
    return LinkMotion(
        centres,
        d_centres,
        dd_centres,
        angles,
        d_angles,
        dd_angles,
        pins=now.pins,
        hip_pins=now.hip_pins,
    )
