"""One picture of a machine: its drawing under the numbers of the moment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.painter import Painter
from stickslip.envs.rendering.scene import paint_scene

if TYPE_CHECKING:
    from stickslip.envs.rendering.drawing import Drawing

Frame = TypeVar("Frame")

BADGE_WIDTH = 118.0


class Readout(NamedTuple):
    """Text above the drawing of one instant.

    numbers: title with unit, and value. badge, colour: the state in a word. at: the instant [s], or
    the place [m].
    """

    numbers: tuple[tuple[str, str], ...]
    badge: str
    colour: str
    at: float


class Renderer(Generic[Frame]):
    """Draws frames of one machine, without a display.

    width, height: of the picture [px]. A picture depends on its frame alone, but for the marks of
    slides, which remember the frames since `reset`; a frame of an earlier instant resets. Needs the
    extra `viz`.
    """

    def __init__(self, width: int = 960, height: int = 540):
        self._size = width, height
        Painter(width, height)  # which refuses sizes, and names a missing extra
        self._at: float | None = None

    def readout(self, frame: Frame) -> Readout:
        """Text above the drawing."""
        raise NotImplementedError

    def drawing(self, frame: Frame) -> Drawing:
        """The drawing of one sample."""
        raise NotImplementedError

    def reset(self) -> None:
        """Forget the history."""
        self._at = None

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture of a frame: uint8 [height, width, 3], a fresh array."""
        readout = self.readout(frame)
        if self._at is not None and self._at > readout.at:
            self.reset()
        self._at = readout.at
        painter = Painter(*self._size)
        left, right, top = theme.MARGIN, painter.width - theme.MARGIN, painter.height - theme.MARGIN
        bottom = top - theme.HEADER
        panel = (left, theme.MARGIN + theme.FOOTER, right, bottom - 10)
        paint_scene(painter, self.drawing(frame), 0, panel)
        titles, values = zip(*readout.numbers, strict=True)
        needed = [painter.width_of(title, theme.SMALL) for title in titles]
        share = (right - left - BADGE_WIDTH - theme.GAP - sum(needed)) / len(needed)
        places = left + share * np.arange(len(needed)) + np.cumsum([0, *needed[:-1]])
        for x, title, value in zip(places, titles, values, strict=True):
            painter.text(x, top - 10, title, theme.SMALL, theme.MUTED)
            painter.text(x, bottom + 3, value, theme.VALUE, bold=True)
        painter.badge((right - BADGE_WIDTH, bottom + 2, right, top), readout.colour)
        size = 14.0 if len(readout.badge) < 9 else 11.0
        place = right - BADGE_WIDTH / 2, (bottom + top + 2) / 2 - 5
        painter.text(*place, readout.badge, size, theme.PAGE, bold=True, align="center")
        return painter.picture()
