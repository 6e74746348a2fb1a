"""Recommended settings and presets for an accuracy, from a measured population.

Errors are for each simulated second, costs are seconds for each simulated second of each
environment. docs/accuracy.md says how they are measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from stickslip.dynamics import checks, names
from stickslip.dynamics.biped import settings
from stickslip.dynamics.biped.params import BipedParams
from stickslip.dynamics.biped.settings import Setting
from stickslip.dynamics.measured import cheapest, measured_beside
from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform

MEASURED = measured_beside(__file__)
"""Measurements that `python -m benchmarks.tradeoff --update` wrote.

settings: fidelity, integrator, dt of the default robot [s], dtype. costs: scene, index of the
setting, environments, seconds for each simulated second and environment. samples: scene, robots,
walks. errors: scene, index, robots, bounds of QUANTILES (null: infinite), share of walks that end
otherwise than their reference. presets: name, index of the setting.
"""

DEFAULT_CRANK, DEFAULT_GRAVITY = 0.030, 9.81
"""Crank length and gravity of the default robot [m, m/s^2], whose scales all numbers have."""

QUANTILES = (0.5, 0.95, 0.99)
"""Shares of all walks for which a bound of the error is measured."""
CONFIDENCE = 0.95
"""Confidence of each bound: one in twenty may be too low."""


@dataclass(frozen=True)
class Recommendation:
    """The cheapest measured setting that meets a tolerance, and its promise.

    setting: its dt is for the robot asked for. promised_error [rad/s]: the worse of the crank
    angle's and the slide's error for each simulated second (a slide counting as the turn that walks
    as far) that a share `quantile` of all walks of the population keeps; an upper bound with
    CONFIDENCE, out of `count` walks. typical_error: the bound for half of the walks. otherwise:
    share of the walks that left the model where their reference did not, or the other way round.
    cost: seconds for each simulated second and environment, at `batch` environments. scene: the
    measured kind of floor. robots: "default", or "any" for the worse of that and of random ones.
    docs/accuracy.md says which walks were drawn, and what is not promised.
    """

    setting: Setting
    typical_error: float
    promised_error: float
    quantile: float
    count: int
    otherwise: float
    cost: float
    scene: str
    robots: str
    batch: int


_SETTINGS = [
    Setting(getattr(settings, table)(**its), getattr(settings, rule)(**options), dt, dtype)
    for (table, its), (rule, options), dt, dtype in MEASURED["settings"]
]


def promises(robots: str, quantile: float = 0.95, time: float = 1.0) -> Iterator[Recommendation]:
    """Every measured point for "default" or "any" robot, as a recommendation.

    time: the robot's own time in that of the default one, with which steps, errors and costs scale.
    """
    kinds = ("default",) if robots == "default" else ("default", "others")
    place = QUANTILES.index(quantile)
    errors = {(scene, index, of): rest for scene, index, of, *rest in MEASURED["errors"]}
    counts = {(scene, of): count for scene, of, count in MEASURED["samples"]}
    for scene, index, batch, cost in MEASURED["costs"]:
        bounds, shares = zip(*(errors[scene, index, kind] for kind in kinds), strict=True)
        worst = np.max(np.nan_to_num(np.array(bounds, float), nan=np.inf, posinf=np.inf), axis=0)
        setting = _SETTINGS[index]
        yield Recommendation(
            setting=replace(setting, dt=setting.dt * time),
            typical_error=float(worst[0, 0]) / time,
            promised_error=float(worst[place, 0]) / time,
            quantile=quantile,
            count=min(counts[scene, kind] for kind in kinds),
            otherwise=max(shares),
            cost=cost / time,
            scene=scene,
            robots=robots,
            batch=batch,
        )


CLASSES = {Grip: "smooth", Uniform: "stick-slip", Patches: "ice"}
"""The measured kind of floor that stands for one."""
SCENES = tuple(CLASSES.values())
PRESET_SCENE, PRESET_BATCH = "stick-slip", 4096
"""The front of the presets, for a training's usual batch."""


def recommend(
    tolerance: float,
    scene: Scene | str = "stick-slip",
    batch: int = 1,
    *,
    params: BipedParams | None = None,
    quantile: float = 0.95,
) -> Recommendation:
    """The cheapest measured setting whose promised error on such a floor is within the tolerance.

    A promise is about a population of seeded walks: a share `quantile` (0.5, 0.95 or 0.99) of them
    keeps it. A walk of your own may be compared with one by EventExact (docs/accuracy.md).

    tolerance: of the crank angle, for each simulated second [rad/s], and of the foot's slide as far
    as such a turn walks. scene: a Scene, judged by its floor (Grip: smooth, Uniform: stick-slip,
    Patches: ice), or such a name, or a scene's. batch: environments stepped together; the nearest
    measured one counts. params: the robot, or a batch, of which the quickest counts; the default
    one if None. Steps, errors and costs scale with its own time sqrt(crank / gravity), and random
    robots were walked, too. ValueError with the best reachable error if none meets it.
    """
    accepted = "a finite error > 0 for each simulated second"
    checks.require_number("tolerance", tolerance, low=0.0, strict=True, accepted=accepted)
    checks.require_integer("batch", batch)
    name, time = scene_class(scene), _own_time(params)
    if quantile not in QUANTILES:
        known = ", ".join(map(str, QUANTILES))
        raise ValueError(f"quantile = {checks.shown(quantile)} is not measured; accepted: {known}")
    loaded = isinstance(scene, Scene) and scene.payload is not None
    robots = "default" if params is None and not loaded else "any"
    points = (point for point in promises(robots, quantile, time) if point.scene == name)
    walks = f"{100 * quantile:g} % of the walks in the scene {name!r} with {{batch}} environments"
    return cheapest(points, batch, tolerance, f"no measured setting keeps so many rad/s on {walks}")


def setting_of(setting: str | Setting) -> Setting:
    """A preset by name, or the setting itself; ValueError for an unknown one."""
    if isinstance(setting, Setting):
        return setting
    checks.require_choice("setting", setting, PRESETS)
    return PRESETS[setting]


def scene_class(scene: Scene | str) -> str:
    """The measured kind that stands for `scene`; ValueError for one that none stands for."""
    if isinstance(scene, str):
        checks.require_choice("scene", scene, (*SCENES, *names.SCENES))
        if scene in SCENES:
            return scene
        scene = Scene.named(scene)
    floor = getattr(scene, "floor", None)
    if type(floor) not in CLASSES:
        raise ValueError(
            f"scene = {scene!r}: nothing is measured for it; accepted: a Scene on "
            f"{', '.join(kind.__name__ for kind in CLASSES)}, or {', '.join(map(repr, SCENES))}"
        )
    return CLASSES[type(floor)]


def _own_time(params: BipedParams | None) -> float:
    """The robot's own time in that of the default one; the shortest of a batch."""
    if params is None:
        return 1.0
    checks.require_kind("params", params, BipedParams, "BipedParams, or None for the default robot")
    params.validate()
    time = np.sqrt(np.asarray(params.crank, float) / np.asarray(params.gravity, float))
    return float(np.min(time)) / math.sqrt(DEFAULT_CRANK / DEFAULT_GRAVITY)


PRESETS: dict[str, Setting] = {name: _SETTINGS[index] for name, index in MEASURED["presets"]}
"""Settings by name: "fast", "balanced", "exact": points of the measured front of PRESET_SCENE and
PRESET_BATCH (docs/accuracy.md)."""
