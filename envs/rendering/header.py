"""Numbers of the moment above the picture, and what the colours mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.lettering import brief, written

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.envs.rendering.canvas import Box, Canvas
    from stickslip.envs.rendering.frame import BipedFrame

BADGE_WIDTH = 118.0


TITLES = (
    ("time  [s]", 0.0),
    ("walked  [m]", 0.18),
    ("steps", 0.35),
    ("mean rate  [rad/s]", 0.465),
    ("friction / normal", 0.715),
)


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


class Header(Board):
    """Five numbers and a badge that says whether the foot sticks, slips or the walk has ended."""

    def __init__(self, canvas: Canvas, box: Box):
        super().__init__(canvas, box, TITLES)

    def move(self, frame: BipedFrame, walked: float) -> None:
        """Show a frame; `walked` is the hip's way since the start of the first step [m]."""
        use = (
            written(abs(frame.friction_force) / frame.normal_force, 2)
            if frame.normal_force > 0
            else "–"
        )
        words = (
            written(frame.time, 2),
            written(walked, 2),
            f"{frame.steps}",
            brief(frame.mean_crank_rate),
            use if frame.mu_static is None else f"{use} of {frame.mu_static:.2f}",
        )
        if frame.status.lower() not in ("ok", "slip_onset"):
            self.show(words, frame.status.replace("_", " ").upper(), theme.INK)
        elif frame.sticking:
            self.show(words, "STICK", theme.HOLDS)
        else:
            self.show(words, "SLIP", theme.SLIDES)


def draw_key(canvas: Canvas, left: float, top: float) -> None:
    """What the colours stand for, in the still background; the words are all there is to read."""
    entries = (
        (theme.SUPPORT["main"], "supporting leg"),
        (theme.SWING["main"], "swinging leg"),
        (theme.HIP_EDGE, "hip and slot"),
        (theme.MOTOR, "crank and motor"),
        (theme.HOLDS, "foot holds (force, cone)"),
        (theme.SLIDES, "foot slides (and marks)"),
    )
    draw_entries(canvas, entries, left, top)


def draw_entries(
    canvas: Canvas, entries: tuple[tuple[str, str], ...], left: float, top: float
) -> None:
    """Colours with their words below each other, from a place downwards."""
    for i, (colour, words) in enumerate(entries):
        y = top - 17 * i
        canvas.lines([[(left + 3, y), (left + 17, y)]], colour, 5.0, still=True)
        canvas.text(left + 26, y - 4, words, theme.SMALL, theme.MUTED, still=True)
