"""The least friction that holds the foot throughout a motion without slip.

A motion is a row of pieces of the crank angle with a constant acceleration, or with a constant
torque T. Of the latter the work equation gives b = crank rate^2 at every angle, exactly:
M b / 2 + V = M0 b0 / 2 + V0 + T (theta - theta0) (MODEL 1.4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np
from scipy.interpolate import CubicSpline

from stickslip.dynamics.biped import SUPPORT_START
from stickslip.optim.gait.gait import friction_uses
from stickslip.optim.gait.profile import Grid, Profile, Profiles, robot_of

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.dynamics.biped import BipedParams

CLOSE = np.pi / 1000
"""Distance of samples [rad]. A parabola through three of them gives the maximum."""
MOST_SAMPLES = 2_000_000
"""Of a motion; in a longer one they stand farther apart."""


class Need(NamedTuple):
    """friction: least static friction [-], infinite where nothing presses the foot down.
    crank_angle: of the supporting leg where it is needed [rad]."""

    friction: float
    crank_angle: float


@dataclass(frozen=True)
class Footing:
    """A robot's inertia functions for `Need`s. Build it with `of`."""

    profiles: Profiles

    @classmethod
    def of(cls, params: BipedParams) -> Footing:
        """Of one robot, which carries its payload. ValueError for a batch."""
        with jax.enable_x64(True):
            return cls(Profiles(params, robot_of(params, 1, False), Grid(1, 1000)))

    @cached_property
    def height(self) -> CubicSpline:
        """Potential energy over the crank angle of the supporting leg [J]."""
        nodes = self.profiles.nodes
        return CubicSpline(nodes.theta[0], nodes.fall[0]).antiderivative()

    @property
    def start_torque(self) -> float:
        """The least constant torque that walks from rest at pi/2 [N m].

        From rest, M b / 2 = T (theta - pi/2) - (V - V(pi/2)): the crank gets past every angle if T
        is above the greatest mean slope of V.
        """
        theta = self.profiles.nodes.theta[0]
        rise = self.height(theta[1:]) - self.height(theta[0])
        return peak_of(rise / (theta[1:] - theta[0]))[1]

    def at_rate(self, crank_rate: float) -> Need:
        """The need of a constant crank rate [rad/s]."""
        ends = np.array([SUPPORT_START, SUPPORT_START + np.pi])
        return self.accelerated(ends, np.full(2, crank_rate), np.zeros(1))

    def accelerated(
        self,
        angle: Float[np.ndarray, " n+1"],
        rate: Float[np.ndarray, " n+1"],
        acceleration: Float[np.ndarray, " n"],
    ) -> Need:
        """The need of constant accelerations between states. angle [rad]: without wrapping."""

        def law(at: Profile, i: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            a = np.broadcast_to(acceleration[i], turned.shape)
            return a, rate[:-1][i] ** 2 + 2 * a * turned

        return self._need(angle, rate, acceleration, law)

    def along(self, angle: Float[np.ndarray, " n+1"], rate: Float[np.ndarray, " n+1"]) -> Need:
        """The need of crank rates that are straight over the crank angle between states."""
        rise = np.diff(rate) / np.diff(angle)

        def law(at: Profile, i: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            now = rate[:-1][i] + rise[i] * turned
            return rise[i] * now, now**2

        return self._need(angle, rate, rise, law)

    def driven(
        self,
        angle: Float[np.ndarray, " n+1"],
        rate: Float[np.ndarray, " n+1"],
        torque: Float[np.ndarray, " n"],
        seconds: Float[np.ndarray, " n"],
    ) -> Need:
        """The need of constant torques between states. seconds: duration of each piece."""
        phases = _phase(angle[:-1], np.floor((angle[:-1] - SUPPORT_START) / np.pi))
        energy = self.profiles.at(phases).M * rate[:-1] ** 2 / 2 + self.height(phases)

        def law(at: Profile, i: np.ndarray, turned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            work = energy[i] + torque[i] * turned - self.height(at.theta)
            b = np.maximum(2 * work / at.M, 0.0)
            return (torque[i] - at.dM / 2 * b - at.fall) / at.M, b

        return self._need(angle, rate, np.diff(rate) / seconds, law)

    def _need(self, angle, rate, acceleration, law) -> Need:
        """Sample every piece within each step that it passes through, ends included."""
        i, low, high, step = _within_steps(angle, rate, acceleration)
        most = max(2, MOST_SAMPLES // len(low))
        count = int(np.clip(np.ceil(np.max(high - low) / CLOSE), 2, most))
        share = np.linspace(0.0, 1.0, count + 1)
        theta = low[:, None] + (high - low)[:, None] * share
        at = self.profiles.at(_phase(theta, step[:, None]))
        a, b = law(at, i[:, None], theta - angle[i][:, None])
        uses = np.asarray(friction_uses(at.friction(a, b), at.normal(a, b)))
        piece = int(np.argmax(uses)) // (count + 1)
        where, friction = peak_of(uses[piece])
        return Need(friction, float(at.theta[piece, 0] + where * np.ptp(at.theta[piece])))


def peak_of(values: np.ndarray) -> tuple[float, float]:
    """Place of the maximum along an even grid, from 0 to 1, and its value, both by the parabola
    through the largest value and its neighbours."""
    i, last = int(np.argmax(values)), len(values) - 1
    if i in (0, last) or not np.isfinite(values[i]):
        return i / last, float(values[i])
    before, at, after = values[i - 1 : i + 2]
    shift = (before - after) / (2 * (before - 2 * at + after))
    return (i + float(shift)) / last, float(at - (before - after) * shift / 4)


def _phase(angle: np.ndarray, step: np.ndarray) -> np.ndarray:
    """The crank angle of the supporting leg of a step, counted from 0."""
    return np.clip(angle - np.pi * step, SUPPORT_START, SUPPORT_START + np.pi)


def _within_steps(angle, rate, acceleration) -> tuple[np.ndarray, ...]:
    """The pieces cut at exchanges of support: index, lowest and highest angle, step, each [m]."""
    turns = rate[:-1] * rate[1:] < 0
    turned = rate[:-1] ** 2 / (2 * np.where(turns, acceleration, 1.0))
    extreme = np.where(turns, angle[:-1] - turned, angle[:-1])
    low, high = (of(of(angle[:-1], angle[1:]), extreme) for of in (np.minimum, np.maximum))
    first = np.floor((low - SUPPORT_START) / np.pi)
    count = np.maximum(np.ceil((high - SUPPORT_START) / np.pi) - first, 1).astype(int)
    i = np.repeat(np.arange(len(low)), count)
    step = first[i] + np.arange(len(i)) - np.repeat(np.cumsum(count) - count, count)
    begins = SUPPORT_START + np.pi * step
    return i, np.maximum(low[i], begins), np.minimum(high[i], begins + np.pi), step
