"""Which setting for which accuracy: recommendations and presets out of measured points.

Nothing is measured here. `python -m benchmarks.tradeoff --update` measures and writes measured.py;
docs/tradeoff.md says how. Errors are for each simulated second, costs are seconds for each
simulated second of each environment on the machine named in `Recommendation.measured_on`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from stickslip.dynamics.biped import measured
from stickslip.dynamics.biped.fidelity import Fidelity, require_fidelity
from stickslip.dynamics.biped.integrators import EventExact, Integrator, integrator_of
from stickslip.dynamics.checks import require_choice, require_number
from stickslip.dynamics.fronts import front, knee
from stickslip.dynamics.scene import Grip, Patches, Scene, Uniform

if TYPE_CHECKING:
    from collections.abc import Sequence

DTYPES = ("float32", "float64")

WALK_PER_RADIAN = 8 * 0.030 / math.pi
"""How far the measured robot walks while its crank turns by a radian [m]: 8 l8 in half a turn."""

CLASSES = {Grip: "smooth", Uniform: "stick-slip", Patches: "ice"}
"""The measured scene that stands for a kind of floor."""

PRESET_SCENE, PRESET_BATCH = "stick-slip", 4096
"""The front that the presets are taken from: what training does most."""


@dataclass(frozen=True)
class Setting:
    """How a walk is computed: fidelity, integrator, step size and precision. Static, hashable.

    fidelity, integrator: names or instances, kept as instances. dt: length of a step [s]; for
    EventExact, which chooses its own steps, the time between its outputs. dtype: of the robot, the
    scene and the state.
    """

    fidelity: Fidelity = "table"
    integrator: str | Integrator = "rk4_split"
    dt: float = 0.02
    dtype: str = "float32"

    def __post_init__(self):
        object.__setattr__(self, "fidelity", require_fidelity(self.fidelity))
        object.__setattr__(self, "integrator", integrator_of(self.integrator))
        require_number("dt", self.dt, low=0.0, strict=True, accepted="a finite time step > 0 [s]")
        require_choice("dtype", self.dtype, DTYPES)

    def integrator_over(self, period: float) -> Integrator:
        """The integrator for one call over `period` [s], in steps of at most dt."""
        accepted = "a finite time > 0 [s]"
        require_number("period", period, low=0.0, strict=True, accepted=accepted)
        integrator = integrator_of(self.integrator)
        if isinstance(integrator, EventExact):
            return integrator
        return replace(integrator, substeps=max(1, math.ceil(period / self.dt * (1 - 1e-9))))


@dataclass(frozen=True)
class Measurement:
    """One setting in one measured scene and batch.

    angle_error [rad/s], slide_error [m/s]: the largest error of crank angle and slide over the
    scene, for each simulated second. cost: seconds for each simulated second and environment.
    """

    scene: str
    setting: Setting
    batch: int
    angle_error: float
    slide_error: float
    cost: float

    @property
    def error(self) -> float:
        """The worse of both [rad/s], a slide counting as the turn that walks as far."""
        return max(self.angle_error, self.slide_error / WALK_PER_RADIAN)


@dataclass(frozen=True)
class Recommendation:
    """The cheapest measured setting that meets a tolerance.

    error [rad/s]: measured, the worse of the crank angle's and the slide's. cost: seconds for
    each simulated second and environment, at `batch` environments. scene: the measured one.
    """

    setting: Setting
    error: float
    cost: float
    scene: str
    batch: int
    measured_on: str


MEASUREMENTS = tuple(
    Measurement(scene, Setting(*measured.SETTINGS[index]), batch, angle, slide, cost)
    for scene, index, batch, angle, slide, cost in measured.ROWS
)
"""Every measured point that could be the cheapest for some tolerance and precision."""

SCENES = tuple(dict.fromkeys(point.scene for point in MEASUREMENTS))


def recommend(
    tolerance: float,
    scene: Scene | str = "stick-slip",
    batch: int = 1,
    *,
    slide_tolerance: float | None = None,
    dtype: str | None = None,
) -> Recommendation:
    """The cheapest measured setting whose error in such a scene was within the tolerance.

    tolerance: error of the crank angle, for each simulated second [rad/s]. slide_tolerance: of the
    foot's slide [m/s], by default tolerance times 8 l8 / pi, the way that the same turn walks.
    scene: a Scene, judged by its floor (Grip: smooth, Uniform: stick-slip, Patches: ice), or the
    name of a measured scene. batch: environments stepped together; the nearest measured number
    stands for it. dtype: only settings of this precision. Measured on the default robot: another
    robot, floor or torque has other errors. Raises ValueError with the best reachable error if
    nothing meets the tolerance.
    """
    accepted = "a finite error > 0 for each simulated second"
    require_number("tolerance", tolerance, low=0.0, strict=True, accepted=accepted)
    if slide_tolerance is None:
        slide_tolerance = tolerance * WALK_PER_RADIAN
    require_number("slide_tolerance", slide_tolerance, low=0.0, strict=True, accepted=accepted)
    if isinstance(batch, bool) or not isinstance(batch, int) or batch < 1:
        raise ValueError(f"batch = {batch!r}; accepted: an integer >= 1")
    if dtype is not None:
        require_choice("dtype", dtype, DTYPES)
    name = scene_class(scene)
    points = [point for point in MEASUREMENTS if point.scene == name]
    nearest = min({p.batch for p in points}, key=lambda b: abs(math.log(b / batch)))
    points = [p for p in points if p.batch == nearest and dtype in (None, p.setting.dtype)]
    good = [
        point
        for point in points
        if point.angle_error <= tolerance and point.slide_error <= slide_tolerance
    ]
    if not good:
        best = min(points, key=lambda point: point.error)
        raise ValueError(
            f"tolerance = {tolerance:g} rad/s and {slide_tolerance:.3g} m/s: no measured setting "
            f"meets it in the scene {name!r} with {nearest} environments; accepted: from "
            f"{best.angle_error:.2g} rad/s and {best.slide_error:.2g} m/s ({best.setting})"
        )
    return _recommendation(min(good, key=lambda point: (point.cost, point.error)))


def setting_of(setting: str | Setting) -> Setting:
    """A preset by name, or the setting itself; ValueError for an unknown one."""
    if isinstance(setting, Setting):
        return setting
    if not isinstance(setting, str) or setting not in PRESETS:
        raise ValueError(
            f"setting = {setting!r} is unknown; accepted: {', '.join(map(repr, PRESETS))} or a "
            "Setting(...)"
        )
    return PRESETS[setting]


def scene_class(scene: Scene | str) -> str:
    """The measured scene that stands for `scene`; ValueError for one that none stands for."""
    if isinstance(scene, str):
        require_choice("scene", scene, SCENES)
        return scene
    floor = getattr(scene, "floor", None)
    if type(floor) not in CLASSES:
        raise ValueError(
            f"scene = {scene!r}: nothing is measured for it; accepted: a Scene on "
            f"{', '.join(kind.__name__ for kind in CLASSES)}, or {', '.join(map(repr, SCENES))}"
        )
    return CLASSES[type(floor)]


def _recommendation(point: Measurement) -> Recommendation:
    return Recommendation(
        point.setting, point.error, point.cost, point.scene, point.batch, measured.MEASURED_ON
    )


def preset_indices(costs: Sequence[float], errors: Sequence[float]) -> dict[str, int]:
    """Which points of a front the presets are.

    fast: the cheapest within 1e-2 rad/s. balanced: the knee. exact: the cheapest within 1e-8 rad/s.
    Where nothing comes so close, the most accurate.
    """
    along = front(costs, errors)

    def cheapest(tolerance: float) -> int:
        within = [i for i in along if errors[i] <= tolerance]
        return within[0] if within else along[-1]

    return {"fast": cheapest(1e-2), "balanced": knee(costs, errors), "exact": cheapest(1e-8)}


def _presets() -> dict[str, Recommendation]:
    points = [p for p in MEASUREMENTS if (p.scene, p.batch) == (PRESET_SCENE, PRESET_BATCH)]
    chosen = preset_indices([p.cost for p in points], [p.error for p in points])
    return {name: _recommendation(points[index]) for name, index in chosen.items()}


MEASURED_PRESETS = _presets()
"""The presets with what was measured of them."""

PRESETS: dict[str, Setting] = {name: found.setting for name, found in MEASURED_PRESETS.items()}
"""Settings by name: "fast", "balanced", "exact"."""
