"""Measured errors of settings on a population of random walks, and that population."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
from stickslip.dynamics.biped.tables import Table
from stickslip.dynamics.biped.trade.setting import Setting

MEASURED = json.loads(Path(__file__).with_name("measured.json").read_text(encoding="utf-8"))
"""What `python -m benchmarks.tradeoff --update` wrote.

settings: fidelity, integrator, dt of the default robot [s], dtype. costs: scene, index of the
setting, environments, seconds for each simulated second and environment. samples: scene, robots,
walks, share of sensitive ones, amplification that 95 % keep. errors: scene, index, robots, bounds
of QUANTILES (null: infinite), share of walks that end otherwise than their reference.
"""

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


@dataclass(frozen=True)
class Sample:
    """Measured walks. count: how many. sensitive: share of those that amplify what they start with
    more than a thousandfold. amplification: what 95 % of them amplify it by at most."""

    count: int
    sensitive: float
    amplification: float


FIDELITIES = {"Table": Table}
INTEGRATORS = {"RK4Split": RK4Split, "EventExact": EventExact}


def _settings() -> list[Setting]:
    return [
        Setting(FIDELITIES[table](**its), INTEGRATORS[rule](**options), dt, dtype)
        for (table, its), (rule, options), dt, dtype in MEASURED["settings"]
    ]


def _measurements() -> tuple[Measurement, ...]:
    """Every measured point, for the default robot and for any."""
    settings, points = _settings(), []
    errors = {
        (scene, index, robots): (
            tuple(Bound(*(math.inf if v is None else v for v in bound)) for bound in bounds),
            otherwise,
        )
        for scene, index, robots, bounds, otherwise in MEASURED["errors"]
    }
    for scene, index, batch, cost in MEASURED["costs"]:
        default, otherwise = errors[scene, index, "default"]
        others, elsewhere = errors[scene, index, "others"]
        worse = tuple(a.or_worse(b) for a, b in zip(default, others, strict=True))
        for robots, bounds, share in (
            ("default", default, otherwise),
            ("any", worse, max(otherwise, elsewhere)),
        ):
            setting = settings[index]
            points.append(Measurement(scene, robots, setting, batch, bounds, share, cost))
    return tuple(points)


MEASUREMENTS = _measurements()
SAMPLES = {(scene, robots): Sample(*rest) for scene, robots, *rest in MEASURED["samples"]}
"""By scene and robots, "default" or "others"."""
