"""Limits of a gait as rows A a + B b <= C at every crank angle.

With b = crank rate^2 and a = crank acceleration = b'/2, torque, friction, normal force and the
ground's moment about the ankle are affine in a and b (MODEL 1.4, foot at rest), so each limit is a
row with coefficients of the crank angle.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.optim.gait.profile import Profile

TORQUE, FRICTION, NORMAL, ZMP = "torque", "friction", "normal force", "foot edges"
RATE, STANDING = "greatest rate", "squared rate >= 0"
UNITS = {TORQUE: "N m", FRICTION: "N", NORMAL: "N", ZMP: "N m", RATE: "rad^2/s^2"}
UNITS |= {STANDING: "rad^2/s^2"}
"""Unit of a row's violation."""


@dataclass(frozen=True)
class Limits:
    """mu: static friction [n], one a step. torque [N m]; motor: whether that is the motor's, not a
    torque beyond all that matters. min_normal [N]. zmp: whether the zero-moment point must stay
    inside the foot. cap: greatest crank rate, lift_off: a natural one [rad/s]."""

    mu: Float[np.ndarray, "n"] | None
    torque: float
    min_normal: float
    zmp: bool
    cap: float
    lift_off: float
    motor: bool = True

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each row, in order."""
        found = [FRICTION] * 2 if self.mu is not None else []
        return (*[TORQUE] * 2, *found, NORMAL, *([ZMP] * 2 if self.zmp else []), RATE, STANDING)


class Rows(NamedTuple):
    """Coefficients [m, n, ...] of A a + B b <= C, with the size of one unit of each [m]."""

    names: tuple[str, ...]
    A: Float[np.ndarray, "m n ..."]
    B: Float[np.ndarray, "m n ..."]
    C: Float[np.ndarray, "m n ..."]
    size: Float[np.ndarray, "m"]

    def excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit, > 0, in its own unit."""
        return self.A * a + self.B * b - self.C

    def flat(self) -> Rows:
        """All crank angles in one axis, in units of `size`: [m, nodes]."""
        unit = self.size[:, None]
        A, B, C = (part.reshape(len(self.names), -1) / unit for part in (self.A, self.B, self.C))
        return Rows(self.names, A, B, C, self.size)


def affine_torque(p: Profile) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Coefficients of a, b and 1 in the motor's torque [N m]."""
    return p.M, p.dM / 2, p.fall


def affine_ground(
    p: Profile,
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, float]]:
    """The same of the friction force and, with the weight, of the normal force [N]."""
    return (p.P, p.dP), (p.Y, p.dY, p.robot.weight)


def torque_of(p: Profile, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The motor's torque [N m]."""
    on_a, on_b, constant = affine_torque(p)
    return on_a * a + on_b * b + constant


def ground_of(p: Profile, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Friction and normal force [N]."""
    return p.P * a + p.dP * b, p.robot.weight + p.Y * a + p.dY * b


def zmp_of(p: Profile, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The zero-moment point from the ankle forwards [m] (eq. 30)."""
    moment = p.L * a + p.dL * b + p.robot.gravity * p.X
    normal = ground_of(p, a, b)[1]
    return np.divide(moment, normal, out=np.zeros_like(moment), where=normal > 0)


def rows_of(p: Profile, limits: Limits) -> Rows:
    """All limits along a profile [n, ...], its first axis the steps."""
    weight, zero, one = p.robot.weight, np.zeros_like(p.M), np.ones_like(p.M)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray, float]] = []
    on_a, on_b, fall = affine_torque(p)
    parts += [(s * on_a, s * on_b, limits.torque - s * fall, torque_unit(p)) for s in (1, -1)]
    if limits.mu is not None:
        mu = limits.mu.reshape(-1, *[1] * (p.M.ndim - 1))
        for s in (1, -1):
            parts.append((s * p.P - mu * p.Y, s * p.dP - mu * p.dY, mu * weight * one, weight))
    parts.append((-p.Y, -p.dY, (weight - limits.min_normal) * one, weight))
    if limits.zmp:
        unit = weight * max(p.robot.heel + p.robot.toe, p.robot.crank)
        lean = p.robot.gravity * p.X
        for s, edge in ((1, p.robot.toe), (-1, p.robot.heel)):
            A, B = s * p.L - edge * p.Y, s * p.dL - edge * p.dY
            parts.append((A, B, edge * weight - s * lean, unit))
    parts.append((zero, one, limits.cap**2 * one, limits.cap**2))
    parts.append((zero, -one, zero, limits.lift_off**2))
    A, B, C = (np.stack([part[i] for part in parts]) for i in range(3))
    return Rows(limits.names, A, B, C, np.array([part[3] for part in parts]))


def torque_unit(p: Profile) -> float:
    """A torque of the robot's own size [N m]: its weight on a crank's length."""
    return p.robot.weight * p.robot.crank
