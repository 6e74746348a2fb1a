"""An evaluation as text: Markdown, terminal, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from stickslip.agents.statistics import Interval

LEFT = 2
"""Leading columns that hold words."""


@dataclass(frozen=True)
class Column:
    """How a metric is shown. decimals: at most, of the value. percent: the value is a share, shown
    with both ends of its interval, which is not symmetric."""

    name: str
    unit: str
    decimals: int
    percent: bool = False

    @property
    def title(self) -> str:
        """Name and unit."""
        return self.name if self.unit == "-" else f"{self.name} [{self.unit}]"

    def show(self, given: Interval) -> str:
        """The estimate and half the width of its interval; "-" if undefined."""
        if not isfinite(given.value):
            return "-"
        if self.percent:
            ends = "" if not isfinite(given.low) else f" ({given.low:.0%} to {given.high:.0%})"
            return f"{given.value:.0%}{ends}".replace("%", "")
        half = given.high - given.value
        spread = f" ± {half:.{self.decimals}f}" if isfinite(half) else ""
        return f"{given.value:.{self.decimals}f}{spread}".replace("-", "−")


def markdown(head: list[str], body: list[list[str]]) -> str:
    """A GitHub table; numbers to the right."""
    rule = ["---" if i < LEFT else "---:" for i in range(len(head))]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, rule, *body))


def plain_text(head: list[str], body: list[list[str]]) -> str:
    """An aligned table for a terminal; the scene is named where it changes."""
    widths = [max(len(row[i]) for row in (head, *body)) for i in range(len(head))]

    def line(row: list[str]) -> str:
        cells = (
            cell.ljust(width) if i < LEFT else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        return "  ".join(cells).rstrip()

    lines = [line(head), "  ".join("─" * width for width in widths)]
    scene = None
    for row in body:
        if scene not in (None, row[0]):
            lines.append("")
        lines.append(line(["" if row[0] == scene else row[0], *row[1:]]))
        scene = row[0]
    return "\n".join(lines) + "\n"


def csv_text(records: list[dict[str, Any]]) -> str:
    """One line a record; a metric's value, low and high in three columns, empty where undefined."""
    flat = []
    for record in records:
        row = {name: value for name, value in record.items() if name != "metrics"}
        for name, ends in record["metrics"].items():
            row |= {name: ends["value"], f"{name}_low": ends["low"], f"{name}_high": ends["high"]}
        flat.append({name: "" if _undefined(value) else value for name, value in row.items()})
    file = io.StringIO()
    writer = csv.DictWriter(file, list(flat[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return file.getvalue()


def json_text(content: dict[str, Any]) -> str:
    """JSON by the letter: null instead of NaN and infinities."""
    return json.dumps(_jsonable(content), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _undefined(value: Any) -> bool:
    return isinstance(value, float) and not isfinite(value)


def _jsonable(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(name): _jsonable(entry) for name, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_jsonable(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic) or hasattr(value, "dtype"):
        return _jsonable(np.asarray(value).tolist())
    return None if _undefined(value) else value
