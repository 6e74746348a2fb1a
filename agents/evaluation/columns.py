"""Columns of an evaluation's table."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from stickslip.records import table

if TYPE_CHECKING:
    from stickslip.agents.evaluation.statistics import Interval


@dataclass(frozen=True)
class Column(table.Column):
    """decimals: at most, of the value. percent: the value is a share, shown with both ends of its
    interval, which is not symmetric."""

    decimals: int = 0
    percent: bool = False

    def show(self, given: Interval) -> str:
        """The estimate and half the width of its interval; "-" if undefined."""
        if not isfinite(given.value):
            return "-"
        if self.percent:
            ends = "" if not isfinite(given.low) else f" ({given.low:.0%} to {given.high:.0%})"
            return f"{given.value:.0%}{ends}".replace("%", "")
        return given.shown(self.decimals).replace("-", "−")
