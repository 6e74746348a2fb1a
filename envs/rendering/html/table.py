"""Rows with units as a table of a page."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stickslip.records.table import Table


def table_text(title: str, table: Table) -> str:
    """The table as HTML, words to the left and numbers to the right; "-" where there is nothing."""
    kinds = ['class="words"' if column.words else "" for column in table.columns]
    head = "".join(
        f'<th scope="col" {kind}>{escape(column.title)}</th>'
        for column, kind in zip(table.columns, kinds, strict=True)
    )
    body = "".join(
        "<tr>"
        + "".join(f"<td {kind}>{_cell(cell)}</td>" for cell, kind in zip(row, kinds, strict=True))
        + "</tr>\n"
        for row in table.rows
    )
    caption = f"<caption>{escape(title)}</caption>" if title else ""
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(title or "Table")}">'
        f"<table>{caption}<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>\n"
    )


def _cell(cell: object) -> str:
    return "-" if cell is None else escape(str(cell))
