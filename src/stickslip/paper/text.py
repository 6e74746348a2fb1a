"""Columns as CSV, claims as Markdown and for a terminal."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping

from stickslip.paper.result import Claim, Columns
from stickslip.records.table import Column, Table

HEAD = ["figure", "the chapter states", "measured here", "verdict", "why"]


def csv_text(columns: Columns) -> str:
    """One line a row. Numbers with 10 digits, NaN as an empty cell."""
    return Table.of_columns(columns).csv(digits=10)


def claims_text(claims: Mapping[str, Iterable[Claim]]) -> str:
    """A Markdown table of all figures' claims, a row each."""
    return claims_table(claims).markdown()


def claims_in_words(claims: Mapping[str, Iterable[Claim]], width: int = 100) -> str:
    """The same for a terminal: a paragraph each, lines of at most `width` characters."""
    lines = []
    for name, of_figure in claims.items():
        for claim in of_figure:
            lines.append(f"{name}: {claim.verdict}")
            parts = zip(HEAD[1:], (claim.stated, claim.measured, "", claim.why), strict=True)
            for title, text in parts:
                head = f"  {title}: "
                lines += textwrap.wrap(head + text, width, subsequent_indent="    ") * bool(text)
            lines.append("")
    return "\n".join(lines)


def claims_table(claims: Mapping[str, Iterable[Claim]]) -> Table:
    """All figures' claims, a row each."""
    rows = [
        [name, claim.stated, claim.measured, claim.verdict, claim.why]
        for name, of_figure in claims.items()
        for claim in of_figure
    ]
    return Table([Column(title, words=True) for title in HEAD], rows)
