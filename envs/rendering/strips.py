"""Quantities over the last seconds or metres, each in a strip of its own."""

from __future__ import annotations

from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.lettering import written
from stickslip.envs.rendering.ticks import nice_step

if TYPE_CHECKING:
    from stickslip.envs.rendering.canvas import Box, Canvas, Place

SPAN = 4.0
"""Length of the strips [s]."""
KEPT_ROWS = 4096
TITLE = 26.0


def strip_boxes(box: Box) -> list[Box]:
    """The places of three strips, the highest first, with room for a title above each."""
    left, bottom, right, top = box
    height = (top - bottom - 2 * theme.GAP) / 3
    lows = (bottom + i * (height + theme.GAP) for i in (2, 1, 0))
    return [(left, low, right, low + height - TITLE) for low in lows]


class Strip:
    """One quantity against time: title and present value above, scale at the left."""

    def __init__(
        self,
        canvas: Canvas,
        box: Box,
        title: str,
        unit: str,
        colour: str,
        *,
        second: bool = False,
    ):
        self._canvas, self._box = canvas, box
        self._limits = (0.0, 0.0)
        left, bottom, right, top = box
        canvas.area([canvas.corners(box)], theme.PANEL, still=True)
        self._rules = canvas.lines([], theme.RULE, 1.0, cap="butt", still=True)
        self._numbers = [
            canvas.text(left - 6, 0, "", theme.SMALL, theme.MUTED, align="right", still=True)
            for _ in range(7)
        ]
        canvas.text(left, top + 8, f"{title}  [{unit}]", colour=theme.MUTED, still=True)
        self._view = canvas.view()
        place: Place = {"view": self._view, "clip": (left, bottom - 2, right, top + 2)}
        self._shade = canvas.area([], theme.SLIDES, alpha=0.17, **place)
        self._second = None
        if second:
            self._second = canvas.curve(theme.INK, 1.3, dashes=(0, (4.0, 2.6)), **place)
        self._curve = canvas.curve(colour, 1.9, solid_joinstyle="round", **place)
        self._now = canvas.dots(theme.PAGE, 6.5, 1.2, fill=colour, view=self._view)
        self._value = canvas.text(right, top + 8, "", 13.0, bold=True, align="right")
        self._aside = canvas.text(right - 54, top + 8, "", theme.SMALL, theme.MUTED, align="right")
        self.aside = ""
        """A remark before the present value."""

    def move(
        self,
        time: np.ndarray,
        value: np.ndarray,
        spans: list[tuple[float, float]],
        told: str,
        least: tuple[float, float],
        second: np.ndarray | None = None,
    ) -> None:
        """Draw a curve; `least` is the range that its scale always holds."""
        every = value if second is None else np.concatenate([value, second])
        low, high = min(least[0], np.nanmin(every)), max(least[1], np.nanmax(every))
        self._fit(float(low), float(high))
        low, high = self._limits
        self._shade.set_verts([self._canvas.corners((a, low, b, high)) for a, b in spans])
        self._curve.set_data(time, value)
        self._now.set_data(time[-1:], value[-1:])
        if self._second is not None and second is not None:
            self._second.set_data(time, second)
        self._value.words = told
        self._aside.words = self.aside

    def _fit(self, low: float, high: float) -> None:
        """Make the scale hold a range, in steps of a round number."""
        step = nice_step((high - low) / 4)
        first, last = floor(low / step + 1e-6), ceil(high / step - 1e-6)
        if (first * step, last * step) == self._limits:
            return
        self._limits = low, high = first * step, last * step
        left, bottom, right, top = self._box
        across, up = (right - left) / SPAN, (top - bottom) / (high - low)
        self._view.set_matrix(np.array([[across, 0, right], [0, up, bottom - up * low], [0, 0, 1]]))
        marks = [step * i for i in range(first, last + 1)]
        places = [bottom + up * (mark - low) for mark in marks]
        self._rules.set_segments([[(left, y), (right, y)] for y in places])
        digits = max(0, -floor(np.log10(step) + 1e-9))
        for number in self._numbers:
            number.visible = False
        for number, mark, y in zip(self._numbers, marks, places, strict=False):
            number.words = written(mark, digits)
            number.y = y - 3.8
            number.visible = True
        self._canvas.forget_background()


def draw_axis(canvas: Canvas, box: Box, unit: str = "s") -> None:
    """The way back from now along the lower edge of a strip, in [s] or another unit."""
    left, bottom, right, _ = box
    seconds = range(-int(SPAN), 1)
    places = [right + (right - left) * second / SPAN for second in seconds]
    ticks = [[(x, bottom), (x, bottom - 5)] for x in places]
    canvas.lines(ticks, theme.MUTED, 1.0, cap="butt", still=True)
    for second, x in zip(seconds, places, strict=True):
        words = f"−{-second} {unit}" if second else "now"
        align = "center" if second else "right"
        canvas.text(x, bottom - 19, words, theme.SMALL, theme.MUTED, still=True, align=align)
