"""What moves the crank: a given torque (forward dynamics) or a given motion (inverse dynamics).

Integrators know only these functions, so both kinds of walk run under the same friction switching.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Motion, moving, prescribed, sticking
from stickslip.dynamics.biped.floor import Friction
from stickslip.dynamics.scene import Smoothed

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.contact import Coefficients
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.scene import Floor


class Torque(NamedTuple):
    """The motor's torque is given."""

    torque: Float[Array, ""]


class CrankMotion(NamedTuple):
    """The crank's acceleration is given; the motor's torque is whatever that takes."""

    crank_acceleration: Float[Array, ""]


Drive = Torque | CrankMotion


def still_motion(drive: Drive, model: BipedModel, inertia: Coefficients, crank_rate) -> Motion:
    """The motion with the foot held at rest."""
    if isinstance(drive, Torque):
        return sticking(model, inertia, crank_rate, drive.torque)
    zero = jnp.zeros_like(crank_rate)
    return prescribed(model, inertia, crank_rate, drive.crank_acceleration, zero, zero)


def motion_in(
    drive: Drive,
    floor: Floor,
    friction: Friction | None,
    model: BipedModel,
    inertia: Coefficients,
    crank_rate,
    mode,
) -> Motion:
    """The motion in a mode; friction None: the foot cannot slip."""
    if friction is None:
        return still_motion(drive, model, inertia, crank_rate)
    law = moving if isinstance(drive, Torque) else prescribed
    slides = jnp.ones_like(mode, bool) if isinstance(floor, Smoothed) else None
    return law(model, inertia, crank_rate, drive[0], mode, friction.mu_kinetic, slides)
