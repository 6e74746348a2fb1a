"""The units in which a program's numbers are about 1, whatever the robot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.optim.gait.convex.program import STRAIN, TIME, TORQUE, WORK
from stickslip.optim.gait.profile import Profile


@dataclass(frozen=True)
class Units:
    """rate [rad/s], torque [N m]; time 1 / rate, work one torque over a radian."""

    rate: float
    torque: float

    @property
    def b(self) -> float:
        """Unit of rate^2 and of acceleration [rad^2/s^2]."""
        return self.rate**2

    def of(self, term: str) -> float:
        """Unit of an objective's term."""
        sizes: dict[str, float] = {
            TIME: 1 / self.rate,
            TORQUE: self.torque**2 / self.rate,
            WORK: self.torque,
            STRAIN: self.torque**2,
        }
        return sizes[term]


def lift_off_rate(p: Profile) -> float:
    """The constant crank rate at which the foot first leaves the ground [rad/s]: a natural unit."""
    return float(np.sqrt(p.robot.weight / np.max(np.abs(p.dY))))


def swing_torque(p: Profile, rate: float) -> float:
    """A torque that carries and swings the robot at that rate [N m]."""
    return p.robot.weight * p.robot.crank + float(np.max(p.M)) * rate**2
