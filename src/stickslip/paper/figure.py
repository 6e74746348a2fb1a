"""Declaration of the figures: data, drawing, and claims with their verdicts."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from stickslip.dynamics.checks import require_known

AGREES = "agrees"
PARTLY = "partly"
DIFFERS = "differs"
BY_CALIBRATION = "by calibration"
"""The default masses were chosen for this number: no evidence."""
BY_CONSTRUCTION = "by construction"
"""True of every robot and parameter: a check of the computation, no evidence."""
VERDICTS = (AGREES, PARTLY, DIFFERS, BY_CALIBRATION, BY_CONSTRUCTION)

Columns = Mapping[str, Iterable[Any]]
"""Equally long columns of numbers or words by name and unit; NaN is an empty cell."""


@dataclass(frozen=True)
class Claim:
    """The chapter's statement, our measurement, one of VERDICTS, and the reason or the limit."""

    stated: str
    measured: str
    verdict: str
    why: str


@cache
def _texts() -> dict[str, dict[str, dict[str, str]]]:
    """Statements and reasons by figure and claim, of claims.json."""
    return json.loads(Path(__file__).with_name("claims.json").read_text(encoding="utf-8"))


def claim(figure: str, name: str, measured: str, verdict: str) -> Claim:
    """A claim of claims.json with our measurement and its verdict."""
    text = _texts()[figure][name]
    return Claim(text["stated"], measured, verdict, text["why"])


def verdict_of(agrees: object, partly: object = False, word: str = AGREES) -> str:
    """`word` where it agrees, else PARTLY or DIFFERS.

    A claim by construction or by calibration DIFFERS where it does not hold: the computation is
    then wrong.
    """
    return word if agrees else PARTLY if partly else DIFFERS


def share_of(holds: Iterable[object]) -> str:
    """AGREES where every case holds, PARTLY where some do, DIFFERS where none does or none is."""
    cases = [bool(one) for one in holds]
    return verdict_of(cases and all(cases), any(cases))


@dataclass(frozen=True)
class Result:
    """A figure's curves, its drawing and its claims.

    draw: a function without arguments that returns a matplotlib figure.
    """

    columns: Columns
    draw: Callable[[], Any]
    claims: Sequence[Claim] = ()


@dataclass(frozen=True)
class Figure:
    """title: over the picture and in the list. module, function: in this package."""

    title: str
    module: str
    function: str

    def compute(self, samples: int) -> Result:
        """Compute with so many points a step of the biped, or along the bump of Fig. 24."""
        module = import_module(f"stickslip.paper.{self.module}")
        return getattr(module, self.function)(samples)


FIGURES = {
    "fig11": Figure("Motor torque over a step, crank speeds up to 5 rad/s", "steady", "speeds"),
    "fig12": Figure("Motor torque over a step, loads on the hip", "steady", "loads"),
    "fig13": Figure("Crank angle from rest under constant torques", "start", "torques"),
    "fig14": Figure("Crank angle from rest under 1 N m, several total weights", "start", "weights"),
    "fig15": Figure("Forces on the supporting foot over a step", "steady", "forces"),
    "fig16": Figure("States of the flow chart: sticking and sliding", "slip", "states"),
    "fig17": Figure("Foot position at 3 rad/s, friction from 0.03 to 0.1", "slip", "frictions"),
    "fig18": Figure(
        "Foot position with friction 0.1, crank speeds up to 5.5 rad/s", "slip", "speeds"
    ),
    "fig19": Figure(
        "Foot position at 5 rad/s, static friction 0.2, kinetic friction varied",
        "slip",
        "kinetic",
    ),
    "fig24": Figure("UGV: torque over the soft bump, legs held still", "bump", "statics"),
    "fig25": Figure(
        "UGV: over the soft bump with the least variation of torque", "bump", "least_variation"
    ),
}
"""Figures in the chapter's order."""

EVERYTHING = "all"


def figures_of(names: Iterable[str]) -> dict[str, Figure]:
    """The figures asked for, each once, in the chapter's order; ValueError for unknown names."""
    wanted = set(names)
    require_known(sorted(wanted), [*FIGURES, EVERYTHING], "figure here")
    return {name: one for name, one in FIGURES.items() if wanted & {name, EVERYTHING}}
