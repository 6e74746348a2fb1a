"""What an optimisation ends with, as a page: numbers, and what it found to play."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.rendering.html.data import Page
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.envs.rendering.html.data import Shown

COLUMNS = (Column("name", words=True), Column("value", words=True))


def result_page(
    title: str,
    rows: Sequence[tuple[str, str]],
    episodes: tuple[Shown, ...],
) -> Page:
    """Page of an optimisation's result. rows: as the command prints them."""
    table = Table(COLUMNS, [row for row in rows if row[1]])
    return Page(title, tables=(("", table),), episodes=episodes)
