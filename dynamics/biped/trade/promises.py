"""Measured errors of settings on a population of random walks, and that population."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from stickslip.dynamics.biped.trade import measured
from stickslip.dynamics.biped.trade.setting import Setting

DEFAULT_CRANK, DEFAULT_GRAVITY = 0.030, 9.81
"""Crank length and gravity of the default robot [m, m/s^2], whose scales all numbers have."""
WALK_PER_RADIAN = 8 * DEFAULT_CRANK / math.pi
"""Distance that the default robot walks for each radian of its crank [m]: 8 l8 in half a turn."""

QUANTILES = (0.5, 0.95, 0.99)
"""Shares of all walks for which a bound of the error is measured."""
CONFIDENCE = 0.95
"""Confidence of each bound: one in twenty may be too low."""

POPULATION = {
    "default": "the default robot",
    "any": "the default robot, and robots of random crank (0.01 to 0.3 m), masses, payload and "
    "gravity, whichever is worse",
}
KINDS = {
    "smooth": "a floor that holds",
    "stick-slip": "one friction, mu_static 0.02 to 0.5, mu_kinetic 0.6 to 1 of it",
    "ice": "five patches 0.1 to 1.5 steps wide, mu_static 0.2 to 0.6 and 0.01 to 0.1 in turn",
}
DRAWN = (
    "random starts and torques (a proportional controller, one torque, a new torque every 1 to 5 "
    "periods) for 36 own times, sqrt(crank / gravity): the default robot's 2 s"
)
SECONDS = 2.0
"""Durations for the default robot [s]."""
NOT_COVERED = (
    "the rest of such walks, whose errors have no bound (some amplify every error a thousandfold: "
    "see covers); longer walks; floors, torques and linkages outside these ranges; whether a walk "
    "that leaves the model is said to leave it. For one's own walk: check_walk"
)


class Bound(NamedTuple):
    """Upper bounds of a quantile of three errors for each simulated second."""

    joint: float
    """The worse of both [rad/s]."""
    angle: float
    """Error of the crank angle [rad/s]."""
    slide: float
    """[m/s]"""

    def or_worse(self, other: Bound) -> Bound:
        """The worse of both in each error."""
        return Bound(*map(max, self, other))


@dataclass(frozen=True)
class Measurement:
    """One setting on one kind of floor, for one kind of robot and batch.

    robots: "default", or "any" for the worse of that and of random ones. bounds: for each of
    QUANTILES. Lengths and seconds are those of the default robot; so is the setting's dt.
    otherwise: share of walks that end otherwise than their reference, inside the model or outside.
    cost: seconds for each simulated second and environment.
    """

    scene: str
    robots: str
    setting: Setting
    batch: int
    bounds: tuple[Bound, ...]
    otherwise: float
    cost: float

    @property
    def error(self) -> float:
        """Error that 95 % of the walks keep [rad/s]: the worse of angle and slide, the slide as
        the turn that walks as far."""
        return self.bounds[QUANTILES.index(0.95)].joint


def _measurements() -> tuple[Measurement, ...]:
    """Every measured point, for the default robot and for any."""
    points = []
    for scene, index, batch, cost in measured.COSTS:
        setting = Setting(*measured.SETTINGS[index])
        default, otherwise = _errors(scene, index, "default")
        points.append(Measurement(scene, "default", setting, batch, default, otherwise, cost))
        others, elsewhere = _errors(scene, index, "others")
        worse = tuple(a.or_worse(b) for a, b in zip(default, others, strict=True))
        otherwise = max(otherwise, elsewhere)
        points.append(Measurement(scene, "any", setting, batch, worse, otherwise, cost))
    return tuple(points)


def _errors(scene: str, index: int, robots: str) -> tuple[tuple[Bound, ...], float]:
    """Bounds for each of QUANTILES, and the share of walks that end otherwise."""
    bounds, otherwise = measured.ERRORS[scene, index, robots]
    return tuple(Bound(*bound) for bound in bounds), otherwise


MEASUREMENTS = _measurements()
