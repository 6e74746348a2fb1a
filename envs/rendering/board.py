"""Numbers of the moment in a row with a badge, and what colours mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.envs.rendering.canvas import Box, Canvas

BADGE_WIDTH = 118.0


class Board:
    """Numbers with their titles in a row, and a badge at its right end.

    titles: each with its place, as a share of the room beside the badge.
    """

    def __init__(self, canvas: Canvas, box: Box, titles: Sequence[tuple[str, float]]):
        left, bottom, right, top = box
        room = right - left - BADGE_WIDTH - theme.GAP
        self._values = []
        for title, share in titles:
            x = left + share * room
            canvas.text(x, top - 10, title, theme.SMALL, theme.MUTED, still=True)
            self._values.append(canvas.text(x, bottom + 3, "", theme.VALUE, bold=True))
        middle = right - BADGE_WIDTH / 2
        badge = (right - BADGE_WIDTH, bottom + 2, right, top)
        self._badge = canvas.rounded(badge, theme.HOLDS, 6.0)
        self._word = canvas.text(
            middle, (bottom + top + 2) / 2 - 5, "", 14.0, theme.PAGE, bold=True, align="center"
        )

    def show(self, words: Sequence[str], badge: str, colour: str) -> None:
        """Show the numbers, and the badge's word in its colour."""
        for value, word in zip(self._values, words, strict=True):
            value.words = word
        self._badge.set_facecolor(colour)
        self._word.words = badge
        self._word.size = 14.0 if len(badge) < 9 else 11.0


def draw_entries(
    canvas: Canvas, entries: Sequence[tuple[str | None, str]], left: float, top: float
) -> float:
    """Colours with their words below each other, from a place downwards; None: the words go on from
    the line above. Where the next line would be."""
    y = top
    for i, (colour, words) in enumerate(entries):
        y -= 0 if i == 0 else 13 if colour is None else 17
        if colour is not None:
            canvas.lines([[(left + 3, y), (left + 17, y)]], colour, 5.0, still=True)
        canvas.text(left + 26, y - 4, words, theme.SMALL, theme.MUTED, still=True)
    return y - 17
