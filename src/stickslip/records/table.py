"""Rows with units as text (terminal, Markdown, CSV), and results of a command as JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from functools import partial
from math import isfinite
from numbers import Integral
from typing import Any

import numpy as np

BAR = "&#124;"
"""Escape of | in a cell of Markdown."""


@dataclass(frozen=True)
class Column:
    """Name and format of a column. unit: "-" for none. words: left-aligned text."""

    name: str
    unit: str = "-"
    words: bool = field(default=False, kw_only=True)

    @property
    def title(self) -> str:
        """Name and unit."""
        return self.name if self.unit == "-" else f"{self.name} [{self.unit}]"


@dataclass(frozen=True)
class Table:
    """Rows with a cell for each column: a number, words, or None for nothing."""

    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]

    @classmethod
    def of_columns(cls, columns: Mapping[Any, Iterable[Any]]) -> Table:
        """From equally long columns, each by its title or a Column."""
        heads = [one if isinstance(one, Column) else Column(one) for one in columns]
        return cls(heads, list(zip(*columns.values(), strict=True)))

    def rounded(self, digits: int) -> Table:
        """Text of every cell, floats with so many significant digits; None becomes empty."""
        rows = [
            ["" if one is None else with_unit(one, "-", digits) for one in row] for row in self.rows
        ]
        return Table(self.columns, rows)

    def markdown(self, *, aligned: bool = False) -> str:
        """A GitHub table, numbers to the right. aligned: in the text, too."""
        head, *body = [[cell.replace("|", BAR) for cell in line] for line in self._shown()]
        widths = self._widths([head, *body]) if aligned else [3] * len(head)
        rule = []
        for column, width in zip(self.columns, widths, strict=True):
            dashes = width - 1 if aligned and not column.words else width
            rule.append("-" * dashes + ("" if column.words else ":"))
        lines = (self._aligned(line, widths) if aligned else line for line in (head, rule, *body))
        return "".join(f"| {' | '.join(line)} |\n" for line in lines)

    def terminal(self, *, head: bool = True, grouped: bool = False) -> str:
        """Aligned columns. grouped: the first is shown where it changes, after a blank line."""
        shown = self._shown()
        widths = self._widths(shown if head else shown[1:])
        lines = [shown[0], ["─" * width for width in widths]] if head else []
        before = None
        for line in shown[1:]:
            if grouped and before not in (None, line[0]):
                lines.append([""] * len(line))
            lines.append(["" if grouped and line[0] == before else line[0], *line[1:]])
            before = line[0]
        return "".join("  ".join(self._aligned(line, widths)).rstrip() + "\n" for line in lines)

    def csv(self, digits: int | None = None) -> str:
        """A head and a line a row; see `cell_text`."""
        lines = [[column.title for column in self.columns]]
        lines += [[cell_text(value, digits) for value in row] for row in self.rows]
        return "".join(map(csv_line, lines))

    def records(self) -> list[dict[str, Any]]:
        """Rows by the columns' names."""
        names = [column.name for column in self.columns]
        return [dict(zip(names, row, strict=True)) for row in self.rows]

    def _shown(self) -> list[list[str]]:
        head = [column.title for column in self.columns]
        return [head, *([str(value) for value in row] for row in self.rows)]

    def _widths(self, lines: Sequence[Sequence[str]]) -> list[int]:
        return [max(len(line[i]) for line in lines) for i in range(len(self.columns))]

    def _aligned(self, line: Sequence[str], widths: Sequence[int]) -> list[str]:
        return [
            text.ljust(width) if column.words else text.rjust(width)
            for text, width, column in zip(line, widths, self.columns, strict=True)
        ]


@dataclass(frozen=True)
class Content:
    """tables: by name, of numbers and words as they are, not as they are shown. facts: anything
    else that JSON knows, arrays included. units: of numbers among the facts, by their names.
    status: exit status of the command.
    """

    tables: Mapping[str, Table] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    units: Mapping[str, object] = field(default_factory=dict)
    status: int = 0

    def json(self, command: str) -> str:
        """Tables as lists of rows, `units` by table and column ("-": none), then the facts.

        null: what is not defined or not finite. Keys are the columns' names.
        """
        heads = {name: table.columns for name, table in self.tables.items()}
        units = {name: {one.name: one.unit for one in of} for name, of in heads.items()}
        rows = {name: table.records() for name, table in self.tables.items()}
        head = {"command": command, "exit_status": self.status, "units": units | dict(self.units)}
        return json_text(head | rows | dict(self.facts))


def cell_text(value: Any, digits: int | None = None) -> str:
    """A value in CSV: words as they are, numbers with so many digits or all, NaN and None empty."""
    if value is None or value != value:
        return ""
    if digits is None or isinstance(value, Integral | str):
        return str(value)
    return f"{float(value):.{digits}g}"


def with_unit(value: object, unit: str, digits: int = 8) -> str:
    """A number with its unit; a unit of "-" goes unsaid."""
    text = f"{value:.{digits}g}" if isinstance(value, float) else str(value)
    return text if unit == "-" else f"{text} {unit}"


def csv_line(cells: Iterable[Any]) -> str:
    """One line of CSV, with its end."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(cells)
    return text.getvalue()


def json_text(content: Mapping[str, Any]) -> str:
    """JSON by the letter: null instead of NaN and infinities, arrays as lists, named tuples and
    dataclasses as objects, enums by name; anything else by its text."""
    plain = jsonable(content)
    return json.dumps(plain, indent=1, allow_nan=False, ensure_ascii=False, default=str) + "\n"


def jsonable(value: Any, array: Callable[[np.ndarray], Any] = np.ndarray.tolist) -> Any:
    """The value as `json_text` writes it, in what JSON knows; array: what an array becomes."""
    within = partial(jsonable, array=array)
    if isinstance(value, Mapping):
        return {str(name): within(entry) for name, entry in value.items()}
    if isinstance(value, Enum):
        return value.name
    if hasattr(value, "_asdict"):
        return within(value._asdict())
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: within(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, list | tuple):
        return [within(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic) or hasattr(value, "dtype"):
        numbers = np.asarray(value)
        return within(array(numbers) if numbers.ndim else numbers.tolist())
    return None if isinstance(value, float) and not isfinite(value) else value
