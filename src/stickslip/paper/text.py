"""Columns as CSV and claims as Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping
from numbers import Integral, Real

from stickslip.paper.result import Claim, Columns

HEAD = ["figure", "the chapter states", "measured here", "verdict", "why"]


def csv_text(columns: Columns) -> str:
    """One line a row. Numbers with 10 digits, NaN as an empty cell."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow([_cell(value) for value in row])
    return file.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, Integral | str):
        return str(value)
    if isinstance(value, Real):
        number = float(value)
        return "" if number != number else f"{number:.10g}"
    raise TypeError(f"{type(value).__name__} in a column; accepted: numbers and words")


def claims_text(claims: Mapping[str, Iterable[Claim]]) -> str:
    """A Markdown table of all figures' claims, a row each."""
    rows = [
        [name, claim.stated, claim.measured, claim.verdict, claim.why]
        for name, of_figure in claims.items()
        for claim in of_figure
    ]
    return "".join(map(_line, [HEAD, ["---"] * len(HEAD), *rows]))


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |\n"
