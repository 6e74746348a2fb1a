"""Columns as CSV and claims as Markdown."""

from __future__ import annotations

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


def claims_table(claims: Mapping[str, Iterable[Claim]]) -> Table:
    """All figures' claims, a row each."""
    rows = [
        [name, claim.stated, claim.measured, claim.verdict, claim.why]
        for name, of_figure in claims.items()
        for claim in of_figure
    ]
    return Table([Column(title, words=True) for title in HEAD], rows)
