"""Torque (forward dynamics) or motion (inverse dynamics) given at the crank.

Integrators ask a `System` for motions, so both kinds of walk run under the same friction
switching.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.biped.contact import Motion, moving, prescribed, sticking
from stickslip.dynamics.biped.floor import Friction, smoothed_direction
from stickslip.dynamics.scene import Smoothed

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped.contact import Coefficients
    from stickslip.dynamics.biped.model import BipedModel
    from stickslip.dynamics.scene import Scene


class Torque(NamedTuple):
    """The motor's torque is given."""

    torque: Float[Array, ""]


class CrankMotion(NamedTuple):
    """The crank's acceleration is given; the motor's torque follows from it."""

    crank_acceleration: Float[Array, ""]


Drive = Torque | CrankMotion


class System(NamedTuple):
    """Constants of one call; an instant has no duration [s]."""

    model: BipedModel
    scene: Scene
    drive: Drive
    duration: Array
    max_rate: Array | None = None
    """Crank rate beyond which a walk ends as a RUNAWAY [rad/s]; None: no such end."""

    def still(self, inertia: Coefficients, crank_rate: Float[Array, ""]) -> Motion:
        """The motion with the foot held at rest."""
        model, drive = self.model, self.drive
        if isinstance(drive, Torque):
            return sticking(model, inertia, crank_rate, drive.torque)
        zero = jnp.zeros_like(crank_rate)
        return prescribed(model, inertia, crank_rate, drive.crank_acceleration, zero, zero)

    def motion(
        self,
        friction: Friction | None,
        mode: Float[Array, ""],
        inertia: Coefficients,
        crank_rate: Float[Array, ""],
        foot_velocity: Float[Array, ""],
    ) -> Motion:
        """The motion in a mode; on a smoothed floor the velocity takes the mode's place.

        friction None: the foot cannot slip.
        """
        if friction is None:
            return self.still(inertia, crank_rate)
        model, drive, floor, slides = self.model, self.drive, self.scene.floor, None
        if isinstance(floor, Smoothed):
            mode = smoothed_direction(floor, foot_velocity)
            slides = jnp.ones_like(mode, bool)
        law = mode, friction.mu_kinetic, slides
        if isinstance(drive, Torque):
            return moving(model, inertia, crank_rate, drive.torque, *law)
        return prescribed(model, inertia, crank_rate, drive.crank_acceleration, *law)

    def tiny(self):
        """A time too short to matter in the working precision [s]."""
        return 8 * jnp.finfo(self.duration.dtype).eps * self.duration
