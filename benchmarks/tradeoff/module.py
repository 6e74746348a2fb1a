"""The text of stickslip.dynamics.biped.trade.measured: the points that `recommend` chooses from."""

from __future__ import annotations

from typing import Any

from benchmarks.report import where
from benchmarks.tradeoff.points import COSTS, promises_of
from benchmarks.tradeoff.population import FLOORS, ROBOTS

MODULES = {
    "coefficients.series": ("Chebyshev",),
    "coefficients.table": ("Table",),
    "fidelity": ("Joint", "Paper", "Reduced"),
    "stepping.integrators": ("RK4", "Euler", "EventExact", "RK4Split", "SemiImplicitEuler"),
}
"""Where the classes are defined."""

HEAD = '''"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand."""

# fmt: off
# ruff: noqa: E501

from __future__ import annotations
'''


def source(content: dict[str, Any]) -> str:
    """The module's text; the same content gives the same text."""
    settings, costs, errors = _rows(content)
    shown = [
        f'    ({fidelity}, {integrator}, {dt!r}, "{dtype}"),'
        for fidelity, integrator, dt, dtype in settings
    ]
    used = {name for setting in settings for name in (_class(setting[0]), _class(setting[1]))}
    samples = [
        f'    ("{s["scene"]}", "{s["robots"]}"): '
        f"({s['count']}, {s['sensitive']:.3g}, {s['sensitivity'][1]:.3g}),"
        for s in content["population"]["samples"]
    ]
    return "\n".join(
        [
            HEAD,
            *_imports(used),
            "",
            f'MEASURED_ON = "{where(content, "walks")}"',
            '"""Where the costs come from: processor, versions, commit and day."""',
            "",
            f'SAMPLED_ON = "{where(content, "population")}"',
            '"""Where the errors come from."""',
            "",
            'INF = float("inf")',
            "",
            "SETTINGS = (",
            *shown,
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
    )


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


def _class(code: str) -> str:
    return code.split("(")[0]


def _imports(used: set[str]) -> list[str]:
    lines = []
    for module, names in MODULES.items():
        wanted = [name for name in names if name in used]
        if wanted:
            lines.append(f"from stickslip.dynamics.biped.{module} import {', '.join(wanted)}")
    return lines
