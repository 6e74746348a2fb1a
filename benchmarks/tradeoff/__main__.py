"""Errors and costs of settings, which `recommend` and the presets promise.

    python -m benchmarks.tradeoff [--quick] [--update | --redraw] [--only PART ...] [--out FILE]

population: each setting's errors on hundreds of seeded walks. costs: processor time of a simulated
second. Pages and data: what `recommend` reads, the table of docs/accuracy.md and its picture.
"""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks import report
from benchmarks.tradeoff.costs import costs
from benchmarks.tradeoff.walks import FLOORS, ROBOTS, population, samples
from stickslip.dynamics.biped.recommendation import PRESET_BATCH, PRESET_SCENE, QUANTILES
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import WIDTH, make_sheet, name_panel, save_sheet, styled
from stickslip.records.files import write_whole

COSTS = {1: ("cost_1", "wall_1"), 4096: ("cost_4096",)}
"""Environments stepped together, and the columns of which the least is their cost.

One environment keeps one thread busy. Processor time also counts threads of XLA that wait in a
loop for work, up to twice as much; wall time counts what others took. Neither is less than the
work."""
NAMES = ("fidelity", "integrator", "dt", "dtype")
"""Columns that define a setting, as code."""
MEDIAN, PROMISED = str(0.5), str(0.95)
"""Quantiles: of what is typical, and that `recommend` goes by."""


class Promise(NamedTuple):
    """One setting on one kind of floor and of robots: bounds of its errors, and its cost."""

    fidelity: str
    integrator: str
    dt: float
    dtype: str
    bounds: dict[str, tuple[float, float, float]]
    """Error bounds by quantile: the worse of both [rad/s], crank angle [rad/s], slide [m/s]."""
    otherwise: float
    cost: float

    @property
    def family(self) -> str:
        """Name of the integrator."""
        name = report.called(self.integrator)[0]
        return {"EventExact": "event_exact", "RK4Split": "rk4_split"}[name]

    @property
    def error(self) -> float:
        """Promised error [rad/s]."""
        return self.bounds[PROMISED][0]


def cost_of(row: dict[str, Any], batch: int) -> float:
    """Seconds for each simulated second and environment, of a row that has them."""
    return min(row[column] for column in COSTS[batch])


def promises_of(content: dict[str, Any], scene: str, robots: str, batch: int) -> list[Promise]:
    """Every setting measured on the population whose cost is known, the cheapest first."""
    costs = {
        tuple(row[name] for name in NAMES): cost_of(row, batch)
        for row in content["costs"]
        if row["scene"] == scene
    }
    found = []
    for row in content["population"]:
        names = tuple(row[name] for name in NAMES)
        if (row["scene"], row["robots"]) != (scene, robots) or names not in costs:
            continue
        bounds = {
            str(q): tuple(math.inf if v is None else v for v in row["bounds"][str(q)])
            for q in QUANTILES
        }
        found.append(Promise(*names, bounds, row["ends_otherwise"], costs[names]))  # type: ignore[arg-type]
    return sorted(found, key=lambda promise: promise.cost)


def integrator_name(point: Promise) -> str:
    """With its step, or its tolerance where it chooses its steps."""
    if point.family == "event_exact":
        return f"event_exact {report.called(point.integrator)[1].get('rtol', 1e-9):.0e}"
    return f"{point.family} {1e3 * point.dt:g} ms"


def source(content: dict[str, Any]) -> str:
    """Text of dynamics/biped/measured.json; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    costs, errors = [], {}
    for scene, robots, batch in product(FLOORS, ROBOTS, COSTS):
        for promise in promises_of(content, scene, robots, batch):
            index = settings.setdefault(promise[: len(NAMES)], len(settings))
            if robots == ROBOTS[0]:
                costs.append([scene, index, batch, report.three(promise.cost)])
            bounds = [[report.three(v) for v in bound] for bound in promise.bounds.values()]
            share = float(f"{promise.otherwise:.2g}")
            errors[scene, index, robots] = [scene, index, robots, bounds, share]
    presets = presets_of(content).items()
    return report.rows_json(
        {
            "costs_measured_on": report.where(content, "costs"),
            "errors_measured_on": report.where(content, "population"),
            "settings": [
                [report.called(fidelity), report.called(integrator), *rest]
                for fidelity, integrator, *rest in settings
            ],
            "costs": costs,
            "samples": [[s["scene"], s["robots"], s["count"]] for s in content["samples"]],
            "errors": list(errors.values()),
            "presets": [[name, settings[p[: len(NAMES)]]] for name, p in presets],
        }
    )


def presets_of(content: dict[str, Any]) -> dict[str, Promise]:
    """The presets by name.

    fast, balanced: in float32, which needs no switch: the cheapest within 2e-2 rad/s, and the knee.
    exact: the cheapest of all within 1e-8 rad/s. Where nothing comes so close, the most accurate;
    none where nothing was measured.
    """
    points = promises_of(content, PRESET_SCENE, ROBOTS[0], PRESET_BATCH)
    single = [p for p in points if p.dtype == "float32"]
    if not report.front_of(single):
        return {}

    def cheapest(tolerance: float, among: list[Promise]) -> Promise:
        along = report.front_of(among)
        return next((p for p in along if p.error <= tolerance), along[-1])

    fast, exact = cheapest(2e-2, single), cheapest(1e-8, points)
    return {"fast": fast, "balanced": report.knee_of(single), "exact": exact}


def body(content: dict[str, Any]) -> str:
    """The tables of docs/accuracy.md."""
    errors, costs = (report.where(content, part) for part in ("population", "costs"))
    return f"{presets(content)}\n\nPromises: {errors}. Costs: {costs}."


def presets(content: dict[str, Any]) -> str:
    """The presets, what is promised of them, and their costs."""
    chosen = [
        {
            "preset": name,
            "fidelity": "table {pieces}x{degree}".format(**report.called(point.fidelity)[1]),
            "integrator": integrator_name(point),
            "type": point.dtype,
            "typical [rad/s]": f"{point.bounds[MEDIAN][0]:.1e}",
            "promised [rad/s]": f"{point.error:.1e}",
            "cost [s/s]": f"{point.cost:.1e}",
        }
        for name, point in presets_of(content).items()
    ]
    return report.markdown(chosen) if chosen else "Not measured."


MARKERS = {"event_exact": "D", "rk4_split": "o"}
COLOURS = {"float32": theme.MOTOR, "float64": theme.SLIDES}


@styled
def draw(content: dict[str, Any], path: Path) -> None:
    """Write the PNG: bars from what half of the default robot's walks keep to what 99 % keep."""
    figure, axes = make_sheet(len(FLOORS), len(COSTS), (WIDTH, 2.4 * len(FLOORS)), sharex=False)
    shown: dict[str, Any] = {}
    for axis, (floor, batch) in zip(axes, product(FLOORS, COSTS), strict=True):
        points = promises_of(content, floor, ROBOTS[0], batch)
        along = report.front_of(points)
        for p in points:
            look = {"color": COLOURS[p.dtype], "alpha": 1.0 if p in along else 0.35}
            span = p.bounds[MEDIAN][0], min(p.bounds["0.99"][0], 10.0)
            axis.plot([p.cost] * 2, span, lw=1, **look)
            (point,) = axis.plot(p.cost, p.error, MARKERS[p.family], ms=4.5, zorder=3, **look)
            if p in along:
                shown[f"{p.family}, {p.dtype}"] = point
        if along:
            ends = [p.cost for p in along], [p.error for p in along]
            look = {"color": theme.INK, "lw": 0.8, "drawstyle": "steps-post", "zorder": 1}
            (shown["cheapest for its error"],) = axis.plot(*ends, **look)
            knee = report.knee_of(points)
            ring = {"mfc": "none", "mec": theme.INK, "zorder": 4}
            (shown["knee"],) = axis.plot(knee.cost, knee.error, "o", ms=10, **ring)
        axis.set(xscale="log", yscale="log", ylim=(None, 3.0))
        note = f"{batch} environment{'s' if batch > 1 else ''}"
        below = "processor time of a simulated second [s]"
        name_panel(axis, f"{floor}: error [rad/s]", note, below)
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=5)
    save_sheet(figure, path)


DOCUMENT = Path("docs/accuracy.md")
PICTURE = Path("docs/tradeoff.png")
DATA = Path("dynamics/biped/measured.json")
PARTS: dict[str, Any] = {"samples": samples, "population": population, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend`, the page's tables and the picture."""
    draw(content, PICTURE)
    write_whole(DATA, source(content))
    report.put_between(DOCUMENT, body(content))


if __name__ == "__main__":
    report.measured_by_command("tradeoff", __doc__, PARTS, update)
