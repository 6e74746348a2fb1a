"""A computed figure: curves over one axis, which its CSV file and its picture show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.page import Panel
from stickslip.envs.rendering.sheet import LEVEL, WIDTH, family, make_sheet, name_panel, styled
from stickslip.records.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT = 2.6
"""Of a panel [inches]."""


@dataclass(frozen=True)
class Result:
    """A figure's panels over an axis [n] (name and unit), and what was measured for each of its
    claims, by their names in claims.json."""

    axis: str
    x: np.ndarray
    panels: Sequence[Panel]
    measured: Mapping[str, str] = field(default_factory=dict)

    def table(self) -> Table:
        """A column for each curve."""
        columns = {self.axis: self.x}
        for panel in self.panels:
            for line in panel.lines:
                columns[f"{panel.title}, {line.name} [{panel.unit}]"] = line.values
        return Table.of_columns(columns)

    @styled
    def draw(self) -> Figure:
        """A panel below the other, curves from light to dark."""
        figure, axes = make_sheet(len(self.panels), 1, (WIDTH, 0.6 + HEIGHT * len(self.panels)))
        for axis, panel in zip(axes, self.panels, strict=True):
            family(axis, self.x, [(line.name, line.values) for line in panel.lines], ncols=2)
            name_panel(axis, f"{panel.title} [{panel.unit}]")
            for level in panel.limits:
                axis.axhline(level, **LEVEL)
        axes[-1].set_xlabel(self.axis)
        axes[-1].set_xlim(self.x[0], self.x[-1])
        return figure


def each(form: str, values: Mapping[float, float]) -> str:
    """A list of values by the number that varies: form takes the value and the number."""
    return ", ".join(form.format(value, x) for x, value in values.items())
