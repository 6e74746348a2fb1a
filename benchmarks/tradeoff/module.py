"""The text of stickslip.dynamics.biped.measured: the points that `recommend` chooses from."""

from __future__ import annotations

from typing import Any

from benchmarks.report import where
from benchmarks.tradeoff.points import COSTS, undominated
from benchmarks.tradeoff.points import points_of as of

MODULES = {
    "fidelity": ("Joint", "Paper", "Reduced"),
    "integrators": ("RK4", "Euler", "EventExact", "RK4Split", "SemiImplicitEuler"),
    "series": ("Chebyshev",),
    "table": ("Table",),
}
"""Where the classes are defined."""


def source(content: dict[str, Any]) -> str:
    """The module's text; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    rows = []
    for scene in dict.fromkeys(row["scene"] for row in content["rows"]):
        for batch in COSTS:
            for point in undominated(of(content["rows"], scene, batch)):
                index = settings.setdefault(point.setting, len(settings))
                errors = f"{point.angle_error:.3g}, {point.slide_error:.3g}"
                rows.append(f'    ("{scene}", {index}, {batch}, {errors}, {point.cost:.3g}),')
    shown = [
        f'    ({fidelity}, {integrator}, {dt!r}, "{dtype}"),'
        for fidelity, integrator, dt, dtype in settings
    ]
    used = {name for setting in settings for name in (_class(setting[0]), _class(setting[1]))}
    return "\n".join(
        [
            '"""Measured settings, out of `python -m benchmarks.tradeoff --update`: not by hand.',
            "",
            "Points that no other of the same precision beats in cost and in both errors.",
            '"""',
            "",
            "from __future__ import annotations",
            "",
            *_imports(used),
            "",
            f'MEASURED_ON = "{where(content)}"',
            '"""Processor, versions, commit and day."""',
            "",
            "SETTINGS = (",
            *shown,
            ")",
            '"""Fidelity, integrator, dt [s], dtype."""',
            "",
            "ROWS = (",
            *rows,
            ")",
            '"""Scene, index of the setting, environments, error of the crank angle [rad/s], of',
            'the slide [m/s], seconds for each simulated second and environment."""',
            "",
        ]
    )


def _class(code: str) -> str:
    return code.split("(")[0]


def _imports(used: set[str]) -> list[str]:
    lines = []
    for module, names in MODULES.items():
        wanted = [name for name in names if name in used]
        if wanted:
            lines.append(f"from stickslip.dynamics.biped.{module} import {', '.join(wanted)}")
    return lines
