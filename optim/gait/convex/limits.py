"""Limits of a gait as rows A a + B b <= C at every crank angle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.numeric import read_only
from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform
from stickslip.optim.options import as_floats

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.numeric import Lists, Number
    from stickslip.optim.gait.profile import Profile

TORQUE, FRICTION, NORMAL, ZMP = "torque", "friction", "normal force", "foot edges"
RATE, STANDING = "greatest rate", "squared rate >= 0"
UNITS = {TORQUE: "N m", FRICTION: "N", NORMAL: "N", ZMP: "N m", RATE: "rad^2/s^2"}
UNITS |= {STANDING: "rad^2/s^2"}
"""Unit of a row's violation."""
ACCEPTED = "None, a number >= 0, one for each step, or a Scene of dry friction"


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

    def scaled_excess(
        self, a: Float[np.ndarray, "n ..."], b: Float[np.ndarray, "n ..."]
    ) -> Float[np.ndarray, "m n ..."]:
        """Violation of each limit in units of `size`."""
        return self.excess(a, b) / self.size.reshape(-1, *[1] * np.ndim(a))

    def flat(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """A, B and C, all crank angles in one axis, in units of `size`: [m, nodes]."""
        unit = self.size[:, None]
        A, B, C = (part.reshape(len(self.names), -1) / unit for part in (self.A, self.B, self.C))
        return A, B, C


def rows_of(p: Profile, limits: Limits) -> Rows:
    """All limits along a profile [n, ...], its first axis the steps."""
    weight, zero, one = p.robot.weight, np.zeros_like(p.M), np.ones_like(p.M)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray, float]] = []
    for s in (1, -1):
        parts.append((s * p.M, s * (p.dM / 2), limits.torque - s * p.fall, torque_unit(p)))
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


def friction_along(
    mu: Number | Lists | Scene | None, steps: int, step_length: float
) -> Float[np.ndarray, "n"] | None:
    """Static friction of each step [n], None where the foot never slips.

    A scene's patches count where the supporting ankle stands: step k at k step lengths [m].
    """
    if mu is None:
        return None
    if not isinstance(mu, Scene):
        found = as_floats("mu", mu, ACCEPTED)
        if found.shape not in ((), (steps,)):
            raise ValueError(f"mu has shape {found.shape}; accepted: one number, or ({steps},)")
    else:
        floor = mu.floor
        if isinstance(floor, Grip):
            return None
        if isinstance(floor, Patches):
            edges = as_floats("edges", floor.edges, "finite positions [m]")
            coefficients = as_floats("mu_static", floor.mu_static, "numbers >= 0")
            at = np.searchsorted(edges, step_length * np.arange(steps), side="right")
            found = np.broadcast_to(coefficients, (len(edges) + 1,))[at]
        elif isinstance(floor, Uniform):
            found = as_floats("mu_static", floor.mu_static, ACCEPTED)
        else:
            raise ValueError(f"mu is a scene with the floor {floor!r}; accepted: {ACCEPTED}")
        if found.ndim > 1 or (found.ndim == 1 and found.shape != (steps,)):
            raise ValueError(f"mu is a batch of floors {found.shape}; accepted: one floor")
    if np.any(found < 0):
        raise ValueError(f"mu = {float(np.min(found))!r} is not accepted; accepted: {ACCEPTED}")
    return read_only(np.broadcast_to(found, (steps,)).astype(float))
