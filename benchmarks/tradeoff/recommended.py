"""The module that `recommend` reads and the page's tables, out of the results."""

from __future__ import annotations

import math
from typing import Any

from benchmarks.points import front_of, knee_of
from benchmarks.report import markdown, where
from benchmarks.tradeoff.points import (
    COSTS,
    Promise,
    fidelity_name,
    integrator_name,
    promises_of,
)
from benchmarks.tradeoff.population import FLOORS, ROBOTS
from stickslip.dynamics.biped.trade.settings import PRESET_BATCH, PRESET_SCENE, preset_indices

HEAD = '''"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand."""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations

from stickslip.dynamics.biped.coefficients.table import Table
from stickslip.dynamics.biped.stepping.integrators import EventExact, RK4Split
'''


def source(content: dict[str, Any]) -> str:
    """Text of stickslip.dynamics.biped.trade.measured; the same content gives the same text."""
    settings, costs, errors = _rows(content)
    samples = [
        f'    ("{s["scene"]}", "{s["robots"]}"): '
        f"({s['count']}, {s['sensitive']:.3g}, {s['sensitivity'][1]:.3g}),"
        for s in content["samples"]
    ]
    lines = [
        HEAD,
        f'MEASURED_ON = "{where(content, "costs")}"',
        '"""Where the costs come from: processor, versions, commit and day."""',
        "",
        f'SAMPLED_ON = "{where(content, "population")}"',
        '"""Where the errors come from."""',
        "",
        'INF = float("inf")',
        "",
        "SETTINGS = (",
        *(f'    ({fid}, {integ}, {dt!r}, "{dtype}"),' for fid, integ, dt, dtype in settings),
        ")",
        '"""Fidelity, integrator, dt of the default robot [s], dtype."""',
        "",
        "COSTS = (",
        *costs,
        ")",
        '"""Scene, index of the setting, environments, seconds for each simulated second and',
        'environment."""',
        "",
        "SAMPLES = {",
        *samples,
        "}",
        '"""By scene and robots: walks, share of sensitive ones, and what 95 % amplify by."""',
        "",
        "ERRORS = {",
        *errors,
        "}",
        '"""By scene, index of the setting and robots: bounds of the quantiles, for each the',
        "worse of both [rad/s], crank angle [rad/s] and slide [m/s], in lengths and seconds of",
        'the default robot; share of walks that end otherwise than their reference."""',
        "",
    ]
    return "\n".join(lines)


def _rows(content: dict[str, Any]) -> tuple[list[tuple], list[str], list[str]]:
    """Settings by index, lines of COSTS, lines of ERRORS."""
    settings: dict[tuple, int] = {}
    costs, errors = [], {}
    for scene in FLOORS:
        for robots in ROBOTS:
            for batch in COSTS:
                for promise in promises_of(content, scene, robots, batch):
                    index = settings.setdefault(promise.setting, len(settings))
                    if robots == ROBOTS[0]:
                        costs.append(f'    ("{scene}", {index}, {batch}, {promise.cost:.3g}),')
                    bounds = ", ".join(map(_triple, promise.bounds.values()))
                    errors[scene, index, robots] = (
                        f'    ("{scene}", {index}, "{robots}"): '
                        f"(({bounds}), {promise.otherwise:.2g}),"
                    )
    return list(settings), costs, list(errors.values())


def _triple(values: tuple[float, float, float]) -> str:
    return f"({', '.join('INF' if v == float('inf') else f'{v:.3g}' for v in values)})"


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
