"""The chapter's figures by name. A module is imported when its figure is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from stickslip.dynamics.plain_checks import nearest

if TYPE_CHECKING:
    from stickslip.paper.result import Result, Setting


@dataclass(frozen=True)
class Figure:
    """title: over the picture and in the table. module, function: what computes it.
    endings: of its CSV files, "" for the one named like the figure."""

    title: str
    module: str
    function: str
    endings: tuple[str, ...] = ("",)

    def compute(self, setting: Setting) -> Result:
        """Import the module and compute the figure."""
        work: Callable[[Setting], Result] = getattr(
            import_module(f"stickslip.paper.{self.module}"), self.function
        )
        return work(setting)


FIGURES = {
    "fig11": Figure("Motor torque over a step, crank speeds up to 5 rad/s", "torque", "speeds"),
    "fig12": Figure("Motor torque over a step, loads on the hip", "torque", "loads"),
    "fig13": Figure("Crank angle from rest under constant torques", "start", "torques"),
    "fig14": Figure("Crank angle from rest under 1 N m, several total weights", "start", "weights"),
    "fig15": Figure("Forces on the supporting foot over a step", "foot", "forces"),
    "fig16": Figure(
        "Through the flow chart: sticking and sliding", "chart", "states", ("", "-euler")
    ),
    "fig17": Figure(
        "Place of the foot at 3 rad/s, friction from 0.03 to 0.1",
        "slip",
        "frictions",
        ("", "-slides"),
    ),
    "fig18": Figure(
        "Place of the foot with friction 0.1, crank speeds up to 5.5 rad/s",
        "slip",
        "speeds",
        ("", "-slides"),
    ),
    "fig19": Figure(
        "Place of the foot at 5 rad/s, static friction 0.2, kinetic friction varied",
        "slip",
        "kinetic",
        ("", "-slides"),
    ),
    "fig24": Figure(
        "UGV: torque over the soft bump, legs held still", "bump", "statics", ("", "-pairs")
    ),
    "fig25": Figure(
        "UGV: over the soft bump with the least variation of torque",
        "passage",
        "least_variation",
        ("", "-between"),
    ),
    "scheme": Figure("The chapter's own scheme beside the exact one", "scheme", "scheme"),
}
"""In the chapter's order; "scheme" compares its numerical method with this package's."""

EVERYTHING = "all"


def figures_of(names: Iterable[str]) -> dict[str, Figure]:
    """The figures asked for, each once, in the chapter's order; ValueError for unknown names."""
    wanted = {names} if isinstance(names, str) else set(names)
    unknown = sorted(wanted - {*FIGURES, EVERYTHING})
    if unknown or not wanted:
        given = ", ".join(map(repr, unknown)) or "no figure"
        accepted = ", ".join([*FIGURES, EVERYTHING])
        near = nearest(unknown[0], FIGURES) if unknown else ""
        raise ValueError(f"{given} is not a figure here; accepted: {accepted}{near}")
    if EVERYTHING in wanted:
        return dict(FIGURES)
    return {name: figure for name, figure in FIGURES.items() if name in wanted}
