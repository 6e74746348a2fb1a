"""The text of stickslip.dynamics.ugv.trade.measured: the promises that `recommend` chooses from."""

from __future__ import annotations

from typing import Any

from benchmarks.fronts import unbeaten
from benchmarks.report import where
from benchmarks.ugv.population import GROUND, VEHICLES, WHERE, WORDS
from benchmarks.ugv.priced import Promise, costs_of, promises_of
from benchmarks.ugv.promise import CONFIDENCE, QUANTILE

HEAD = '''"""Measured settings, out of `python -m benchmarks.ugv --update`: not by hand.

Without a wrong status in their sample, and not beaten by one of the same precision and checks in
cost and in both promised errors.
"""

from __future__ import annotations

from stickslip.dynamics.ugv.pose_solver import PoseSolver
'''


def source(content: dict[str, Any]) -> str:
    """The module's text; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    promises, costs = [], {}
    for point, priced in kept(content):
        index = settings.setdefault(
            (point.solver, point.dtype, point.pieces_per_wave), len(settings)
        )
        errors = ", ".join(_numbers(three) for three in (point.torque, point.contact))
        promises.append(
            f'    ("{point.ground}", "{point.place}", {index}, {point.poses}, {errors}),'
        )
        for batch, cost in priced.items():
            costs[point.ground, index, batch] = cost
    return "\n".join(
        [
            HEAD,
            f'MEASURED_ON = "{where(content, "promise")}"',
            '"""Processor, versions, commit and day."""',
            "",
            f"QUANTILE, CONFIDENCE = {QUANTILE}, {CONFIDENCE}",
            '"""Of the promised errors."""',
            "",
            "GROUNDS = {",
            *(f'    "{ground}": "{words}",' for ground, words in WORDS.items()),
            "}",
            "PLACES = {",
            *(f'    "{place}": "{words}",' for place, words in WHERE.items()),
            "}",
            f'EVERYWHERE = "{GROUND}"',
            f'VEHICLES = "{VEHICLES}"',
            '"""The population."""',
            "",
            "SETTINGS = (",
            *(f'    ({solver}, "{dtype}", {pieces}),' for solver, dtype, pieces in settings),
            ")",
            '"""Solver, dtype, pieces of a table for the shortest wave."""',
            "",
            "PROMISES = (",
            *promises,
            ")",
            '"""Ground, place, index of the setting, poses in the sample; typical, promised, worst',
            'error of the torque over weight times radius [-], of the rear contact in radii."""',
            "",
            "COSTS = (",
            *(f'    ("{g}", {index}, {batch}, {cost:.3g}),'
              for (g, index, batch), cost in sorted(costs.items())),
            ")",
            '"""Ground, index of the setting, poses at once, processor seconds for each pose."""',
            "",
        ]
    )  # fmt: skip


def kept(content: dict[str, Any]) -> list[tuple[Promise, dict[int, float]]]:
    """What may be recommended, with its cost for each batch."""
    costs = costs_of(content["trade"])
    able = [p for p in promises_of(content["promise"]) if p.wrong == 0 and costs(p)]
    best = set()
    for batch in dict.fromkeys(batch for p in able for batch in costs(p)):
        priced = [p._replace(cost=costs(p)[batch]) for p in able if batch in costs(p)]
        best |= {
            p._replace(cost=0.0)
            for p in unbeaten(
                priced,
                lambda p: (p.torque[1], p.contact[1]),
                lambda p: (p.ground, p.place, p.dtype, p.checked),
            )
        }
    return [(p, costs(p)) for p in able if p in best]


def _numbers(three: tuple[float, float, float]) -> str:
    """To three digits, but for the median rounded up."""
    typical, *others = three
    return f"({typical:.3g}, {', '.join(f'{1.005 * number:.3g}' for number in others)})"
