"""The text of stickslip.dynamics.ugv.measured: the points that `recommend` chooses from."""

from __future__ import annotations

from typing import Any

from benchmarks.report import where
from benchmarks.ugv.points import points_of, undominated
from benchmarks.ugv.trade import BATCHES


def source(content: dict[str, Any]) -> str:
    """The module's text; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    rows = []
    for track in dict.fromkeys(row["track"] for row in content["trade"]):
        for batch in BATCHES:
            for point in undominated(points_of(content["trade"], track, batch)):
                setting = (point.solver, point.dtype, point.pieces)
                index = settings.setdefault(setting, len(settings))
                numbers = f"{point.torque_error:.3g}, {point.contact_error:.3g}, {point.cost:.3g}"
                rows.append(f'    ("{track}", {index}, {batch}, {numbers}),')
    shown = [f'    ({solver}, "{dtype}", {pieces}),' for solver, dtype, pieces in settings]
    return "\n".join(
        [
            '"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.',
            "",
            "Points that none of the same precision and checks beats in cost and in both errors.",
            '"""',
            "",
            "from __future__ import annotations",
            "",
            "from stickslip.dynamics.ugv.pose_solver import PoseSolver",
            "",
            f'MEASURED_ON = "{where(content, "trade")}"',
            '"""Processor, versions, commit and day."""',
            "",
            "SETTINGS = (",
            *shown,
            ")",
            '"""Solver, dtype, pieces of a table for each metre."""',
            "",
            "ROWS = (",
            *rows,
            ")",
            '"""Track, index of the setting, poses at once, error of the torque over weight times',
            'radius [-], of the rear contact [m], processor seconds for each pose."""',
            "",
        ]
    )
