"""The data that `recommend` reads and the page's tables, out of the results."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from benchmarks.points import USEFUL, front, front_of, knee, knee_of
from benchmarks.report import called, markdown, rows_json, three, where
from benchmarks.tradeoff.points import (
    COSTS,
    Promise,
    fidelity_name,
    integrator_name,
    promises_of,
)
from benchmarks.tradeoff.population import FLOORS, ROBOTS
from stickslip.dynamics.biped.recommendation import PRESET_BATCH, PRESET_SCENE


def source(content: dict[str, Any]) -> str:
    """Text of dynamics/biped/measured.json; the same content gives the same text."""
    settings, costs, errors = _rows(content)
    samples = [
        [s["scene"], s["robots"], s["count"], three(s["sensitive"]), three(s["sensitivity"][1])]
        for s in content["samples"]
    ]
    return rows_json(
        {
            "costs_measured_on": where(content, "costs"),
            "errors_measured_on": where(content, "population"),
            "settings": settings,
            "costs": costs,
            "samples": samples,
            "errors": errors,
            "presets": _presets(content),
        }
    )


def _presets(content: dict[str, Any]) -> list[list]:
    """Name and index of the setting of each preset."""
    settings, _, _ = _rows(content)
    points = promises_of(content, PRESET_SCENE, ROBOTS[0], PRESET_BATCH)
    columns = zip(*((p.cost, p.error, p.dtype) for p in points), strict=True)
    chosen = {name: points[i] for name, i in preset_indices(*columns).items()}
    return [
        [name, settings.index([called(p.fidelity), called(p.integrator), p.dt, p.dtype])]
        for name, p in chosen.items()
    ]


def preset_indices(
    costs: Sequence[float], errors: Sequence[float], dtypes: Sequence[str]
) -> dict[str, int]:
    """Indices of the presets among the points of a front.

    fast, balanced: in float32, which needs no switch: the cheapest within 2e-2 rad/s, and the knee.
    exact: the cheapest of all within 1e-8 rad/s. Where nothing comes so close, the most accurate.
    """

    def cheapest(tolerance: float, among: Sequence[int]) -> int:
        along = [among[i] for i in front([costs[i] for i in among], [errors[i] for i in among])]
        within = [i for i in along if errors[i] <= tolerance]
        return within[0] if within else along[-1]

    everything = range(len(costs))
    single = [i for i in everything if dtypes[i] == "float32" and errors[i] <= USEFUL] or everything
    bend = single[knee([costs[i] for i in single], [errors[i] for i in single])]
    fast, exact = cheapest(2e-2, single), cheapest(1e-8, everything)
    return {"fast": fast, "balanced": bend, "exact": exact}


def _rows(content: dict[str, Any]) -> tuple[list[list], list[list], list[list]]:
    """Settings by index, rows of costs, rows of errors."""
    settings: dict[tuple, int] = {}
    costs, errors = [], {}
    for scene in FLOORS:
        for robots in ROBOTS:
            for batch in COSTS:
                for promise in promises_of(content, scene, robots, batch):
                    index = settings.setdefault(promise.setting, len(settings))
                    if robots == ROBOTS[0]:
                        costs.append([scene, index, batch, three(promise.cost)])
                    bounds = [[three(v) for v in bound] for bound in promise.bounds.values()]
                    share = float(f"{promise.otherwise:.2g}")
                    errors[scene, index, robots] = [scene, index, robots, bounds, share]
    known = [[called(fid), called(integ), dt, dtype] for fid, integ, dt, dtype in settings]
    return known, costs, list(errors.values())


def body(content: dict[str, Any]) -> str:
    """The tables of docs/tradeoff.md."""
    parts = [
        f"Promises: {where(content, 'population')}. Costs: {where(content, 'costs')}.",
        "### Presets",
        presets(content),
        "### The fronts",
        fronts(content),
    ]
    return "\n\n".join(parts)


def presets(content: dict[str, Any]) -> str:
    """The presets, what is promised of them, and their costs."""
    points = promises_of(content, PRESET_SCENE, ROBOTS[0], PRESET_BATCH)
    if not front_of([p for p in points if p.dtype == "float32"]):
        return "Not measured."
    columns = zip(*((p.cost, p.error, p.dtype) for p in points), strict=True)
    chosen = preset_indices(*columns)
    return markdown([{"preset": name} | _columns(points[i]) for name, i in chosen.items()])


def fronts(content: dict[str, Any]) -> str:
    """Every point of every front of the default robot, its knee marked."""
    lines = []
    for scene in FLOORS:
        for batch in COSTS:
            points = promises_of(content, scene, ROBOTS[0], batch)
            if not front_of(points):
                continue
            knee = knee_of(points)
            for point in front_of(points):
                mark = {"": "knee" if point is knee else ""}
                lines.append({"floor": scene, "environments": batch} | _columns(point) | mark)
    return markdown(lines) if lines else "Not measured."


def _columns(point: Promise) -> dict[str, Any]:
    return {
        "fidelity": fidelity_name(point.fidelity),
        "integrator": integrator_name(point),
        "type": point.dtype,
        "typical [rad/s]": _number(point.typical),
        "promised [rad/s]": _number(point.error),
        "cost [s/s]": f"{point.cost:.1e}",
    }


def _number(value: float) -> str:
    return "-" if math.isinf(value) else f"{value:.1e}"
