"""Page of an optimisation's result: numbers, picture and an episode to play."""

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
    picture: bytes | None = None,
) -> Page:
    """Page of an optimisation's result. rows: as the command prints them."""
    table = Table(COLUMNS, [row for row in rows if row[1]])
    pictures = () if picture is None else (("The same as a picture", picture),)
    return Page(title, tables=(("", table),), episodes=episodes, pictures=pictures)
