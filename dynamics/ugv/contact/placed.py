"""A vehicle placed on the track: all its points, and derived quantities."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp

from stickslip.dynamics.ugv.contact.wheel import WheelContact
from stickslip.dynamics.ugv.params import UGVParams

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

    from stickslip.dynamics.ugv.ground.shapes import Values


class Pose(NamedTuple):
    """The half vehicle on the track; points [..., 2] [m], y up, x forwards.

    In the world frame, or, out of `stand`, from `origin`, which keeps the digits of differences
    far from x = 0 and y = 0; `in_world` adds it.
    """

    rear: WheelContact
    front: WheelContact
    wheelbase: Float[Array, "..."]
    """R: between the wheel centres [m] (eq. 39)."""
    pitch: Float[Array, "..."]
    """Angle of the body above the horizontal, nose up positive [rad]."""
    rear_hinge: Float[Array, "... 2"]
    front_hinge: Float[Array, "... 2"]
    body: Float[Array, "... 2"]
    """Centre of mass of the body; of the legs below."""
    rear_leg: Float[Array, "... 2"]
    front_leg: Float[Array, "... 2"]
    clearance: Float[Array, "..."]
    """Least height above the ground [m], measured vertically at points of the body, a line from
    hinge to hinge, and of the legs as far as they stand out of the wheels."""
    wheel_clearance: Float[Array, "..."]
    """Between the wheels [m]: wheelbase - 2 r - wheel_gap. Negative: they overlap."""
    status: Int[Array, "..."]
    """OK, NO_SOLUTION (the wheelbase vanishes), NOT_CONVERGED, HOLLOW_GROUND or NON_FINITE."""
    origin: Float[Array, "... 2"]
    """Origin of the points' frame in the world [m]: zero, or out of `stand` where the
    front wheel touches."""

    def potential_energy(self, params: UGVParams) -> Values:
        """Potential energy above y = 0 [J]; far up, energy_above_origin keeps more digits."""
        return self.energy_above_origin(params) + params.weight * self.origin[..., 1]

    def energy_above_origin(self, params: UGVParams) -> Values:
        """Potential energy of all five bodies above `origin` [J]."""
        wheels = params.wheel_mass * (self.rear.centre[..., 1] + self.front.centre[..., 1])
        legs = params.leg_mass * (self.rear_leg[..., 1] + self.front_leg[..., 1])
        return (wheels + legs + params.body_mass * self.body[..., 1]) * params.gravity

    def in_world(self) -> Pose:
        """The same with every point in the world frame."""
        by = self.origin

        def moved(wheel: WheelContact) -> WheelContact:
            return wheel._replace(
                x=wheel.x + by[..., 0], point=wheel.point + by, centre=wheel.centre + by
            )

        points = ("rear_hinge", "front_hinge", "body", "rear_leg", "front_leg")
        return self._replace(
            rear=moved(self.rear),
            front=moved(self.front),
            origin=jnp.zeros_like(by),
            **{name: getattr(self, name) + by for name in points},
        )
