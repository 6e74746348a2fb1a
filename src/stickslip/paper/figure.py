"""The figures by name; nothing heavy is imported."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

from stickslip.dynamics.checks import require_known

if TYPE_CHECKING:
    from collections.abc import Iterable

    from stickslip.dynamics.biped import BipedParams
    from stickslip.dynamics.ugv import UGVParams
    from stickslip.paper.result import Result


class Figure(NamedTuple):
    """title: over the picture and in the list. module, function: in this package. own: title for
    another machine than the chapter's, whose numbers differ; empty: the same."""

    title: str
    module: str
    function: str
    own: str = ""

    @property
    def machine(self) -> str:
        """biped or ugv."""
        return "ugv" if self.module == "bump" else "biped"

    def compute(self, params: BipedParams | UGVParams, samples: int) -> Result:
        """Compute with so many points a step of the biped, or along the bump of Fig. 24."""
        module = import_module(f"stickslip.paper.{self.module}")
        return getattr(module, self.function)(params, samples)


FIGURES = {
    "fig11": Figure(
        "Motor torque over a step, crank speeds up to 5 rad/s",
        "steady",
        "speeds",
        "Motor torque over a step, crank speeds",
    ),
    "fig12": Figure("Motor torque over a step, loads on the hip", "steady", "loads"),
    "fig13": Figure("Crank angle from rest under constant torques", "start", "torques"),
    "fig14": Figure(
        "Crank angle from rest under 1 N m, several total weights",
        "start",
        "weights",
        "Crank angle from rest, several total weights",
    ),
    "fig15": Figure("Forces on the supporting foot over a step", "steady", "forces"),
    "fig16": Figure("States of the flow chart: sticking and sliding", "slip", "states"),
    "fig17": Figure(
        "Foot position at 3 rad/s, friction from 0.03 to 0.1",
        "slip",
        "frictions",
        "Foot position, friction from 0.03 to 0.1",
    ),
    "fig18": Figure(
        "Foot position with friction 0.1, crank speeds up to 5.5 rad/s",
        "slip",
        "speeds",
        "Foot position with friction 0.1, crank speeds",
    ),
    "fig19": Figure(
        "Foot position at 5 rad/s, static friction 0.2, kinetic friction varied",
        "slip",
        "kinetic",
        "Foot position, static friction 0.2, kinetic friction varied",
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
