"""What a picture of the UGV shows, as plain numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WheelFrame:
    """One wheel. centre, contact: points (x, y) [m]. slope: of the ground under it [rad]. turned:
    its angle in the world, anticlockwise [rad]. hinge: of its leg [m]. leg_angle [rad]. friction,
    normal: of the ground on the wheel, along it forwards and out of it [N]. mu: under it [-]."""

    centre: np.ndarray
    contact: np.ndarray
    slope: float
    turned: float
    hinge: np.ndarray
    leg_angle: float
    friction: float
    normal: float
    mu: float


@dataclass(frozen=True)
class UGVFrame:
    """The UGV at one station. Nothing is computed from it but positions.

    x: of the front contact; start: where the drive began [m]. rear, front: the wheels.
    ground: points [n, 2] of the profile about the vehicle, and preview: points [k, 2] of it that
    are observed, without noise [m]. pitch [rad]. torque: on each wheel [N m]. cost: the criterion
    so far. mu: under the wheels, the lesser of them [-]. grip: the lesser margin mu N - |F| [N].
    status: "ok", or what ended the drive. ground_mu: at the points of `ground` [n], None where it
    is the same everywhere.
    """

    x: float
    start: float
    rear: WheelFrame
    front: WheelFrame
    ground: np.ndarray
    preview: np.ndarray
    pitch: float
    torque: float
    cost: float
    mu: float
    grip: float
    status: str = "ok"
    ground_mu: np.ndarray | None = None

    @property
    def demand(self) -> float:
        """The greater |F| / N of both wheels; infinite without a load."""
        return max(
            abs(wheel.friction) / wheel.normal if wheel.normal > 0 else np.inf
            for wheel in (self.rear, self.front)
        )

    @property
    def slips(self) -> bool:
        """Whether a wheel's friction is used up."""
        return self.grip < 0 or self.status == "wheel slip"
