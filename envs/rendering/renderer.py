"""One picture of a machine: its drawing, the numbers of the moment, and their recent course."""

from __future__ import annotations

from collections import deque
from math import ceil, floor
from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.painter import Painter
from stickslip.envs.rendering.scene import paint_scene
from stickslip.envs.rendering.theme import digits_of, nice_step, written

if TYPE_CHECKING:
    from stickslip.envs.rendering.drawing import Drawing
    from stickslip.envs.rendering.painter import Box

Frame = TypeVar("Frame")

SPAN = 4.0
"""Length of the strips, in seconds or metres."""
KEPT_ROWS = 4096
TITLE = 26.0
BADGE_WIDTH = 118.0
PLACES = (0.0, 0.17, 0.35, 0.47, 0.735)
"""Of the numbers, in the room beside the badge."""


class Quantity(NamedTuple):
    """One strip's present value. words: the value; least: the range that the scale always holds;
    second: a dashed curve beside it; aside: a remark."""

    title: str
    unit: str
    colour: str
    value: float
    words: str
    least: tuple[float, float]
    second: float = np.nan
    aside: str = ""


class Readout(NamedTuple):
    """What stands beside the drawing of one instant.

    numbers: title and value, five at most. badge, colour: the state in a word. at: the instant [s],
    or the place [m]. quantities: three, one for each strip. shaded: whether strips are shaded here.
    """

    numbers: tuple[tuple[str, str], ...]
    badge: str
    colour: str
    at: float
    quantities: tuple[Quantity, ...]
    shaded: bool = False


class Renderer(Generic[Frame]):
    """Draws frames of one machine, without a display.

    width, height: of the picture [px]. A picture depends on its frame alone, but for the strips and
    marks of slides, which remember the frames since `reset`; a frame of an earlier instant resets.
    Needs the extra `viz`.
    """

    unit = "s"
    """Of the strips' axis."""

    def __init__(self, width: int = 960, height: int = 540):
        self._size = width, height
        Painter(width, height)  # which refuses sizes, and names a missing extra
        self._rows: deque[Readout] = deque(maxlen=KEPT_ROWS)

    def readout(self, frame: Frame) -> Readout:
        """What stands beside the drawing."""
        raise NotImplementedError

    def drawing(self, frame: Frame) -> Drawing:
        """The drawing of one sample."""
        raise NotImplementedError

    def reset(self) -> None:
        """Forget the history."""
        self._rows.clear()

    def draw(self, frame: Frame) -> np.ndarray:
        """The picture of a frame: uint8 [height, width, 3], a fresh array."""
        readout = self.readout(frame)
        if self._rows and self._rows[-1].at > readout.at:
            self.reset()
        if self._rows and self._rows[-1].at == readout.at:
            self._rows.pop()
        self._rows.append(readout)
        while len(self._rows) > 1 and self._rows[1].at <= readout.at - SPAN:
            self._rows.popleft()
        painter = Painter(*self._size)
        left, bottom = theme.MARGIN, theme.MARGIN + theme.FOOTER
        right, top = painter.width - theme.MARGIN, painter.height - theme.MARGIN
        edge = right - theme.COLUMN
        panel = (left, bottom, edge, top - theme.HEADER - 10)
        paint_scene(painter, self.drawing(frame), 0, panel)
        _header(painter, (left, top - theme.HEADER, edge, top), readout)
        self._strips(painter, (edge + 52, bottom, right, top + TITLE - 18))
        return painter.picture()

    def _strips(self, painter: Painter, box: Box) -> None:
        left, bottom, right, top = box
        height = (top - bottom - 2 * theme.GAP) / 3
        at = np.array([row.at for row in self._rows]) - self._rows[-1].at
        spans = _spans(at, np.array([row.shaded for row in self._rows]))
        for k in range(3):
            low = bottom + (2 - k) * (height + theme.GAP)
            course = [row.quantities[k] for row in self._rows]
            _strip(painter, (left, low, right, low + height - TITLE), at, course, spans)
        for back in range(int(SPAN) + 1):
            x = right - (right - left) * back / SPAN
            painter.line([(x, bottom), (x, bottom - 5)], theme.MUTED, cap="butt")
            words, align = (f"−{back} {self.unit}", "center") if back else ("now", "right")
            painter.text(x, bottom - 19, words, theme.SMALL, theme.MUTED, align=align)


def _header(painter: Painter, box: Box, readout: Readout) -> None:
    left, bottom, right, top = box
    room = right - left - BADGE_WIDTH - theme.GAP
    for (title, value), share in zip(readout.numbers, PLACES, strict=False):
        painter.text(left + share * room, top - 10, title, theme.SMALL, theme.MUTED)
        painter.text(left + share * room, bottom + 3, value, theme.VALUE, bold=True)
    painter.badge((right - BADGE_WIDTH, bottom + 2, right, top), readout.colour)
    size = 14.0 if len(readout.badge) < 9 else 11.0
    place = right - BADGE_WIDTH / 2, (bottom + top + 2) / 2 - 5
    painter.text(*place, readout.badge, size, theme.PAGE, bold=True, align="center")


def _strip(
    painter: Painter,
    box: Box,
    at: np.ndarray,
    course: list[Quantity],
    spans: list[tuple[float, float]],
) -> None:
    """Paint one quantity: title and present value above, scale at the left, its course."""
    left, bottom, right, top = box
    now = course[-1]
    value = np.array([one.value for one in course])
    second = np.array([one.second for one in course])
    step, low, high = _limits(np.concatenate([value, second, now.least]))
    painter.box(box, theme.PANEL)

    def page(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        across = right + (right - left) / SPAN * x
        return np.stack([across, bottom + (top - bottom) * (y - low) / (high - low)], axis=-1)

    for k in range(round(low / step), round(high / step) + 1):
        y = float(page(np.zeros(()), np.asarray(k * step))[1])
        painter.line([(left, y), (right, y)], theme.RULE, cap="butt")
        words = written(k * step, digits_of(step))
        painter.text(left - 6, y - 3.8, words, theme.SMALL, theme.MUTED, align="right")
    with painter.inside((left, bottom - 2, right, top + 2)):
        for a, b in spans:
            corners = page(np.array([a, b, b, a]), np.array([low, low, high, high]))
            painter.area(corners, (theme.SLIDES, 0.17))
        if np.isfinite(second).all():
            painter.line(page(at, second), theme.INK, 1.3, dashes=(5.2, 3.4))
        painter.line(page(at, value), now.colour, 1.9)
    painter.dot(page(at, value)[-1], 6.5, now.colour, theme.PAGE, 1.2)
    painter.text(left, top + 8, f"{now.title}  [{now.unit}]", colour=theme.MUTED)
    painter.text(right, top + 8, now.words, 13.0, bold=True, align="right")
    painter.text(right - 54, top + 8, now.aside, theme.SMALL, theme.MUTED, align="right")


def _limits(values: np.ndarray) -> tuple[float, float, float]:
    """A round step, and the multiples of it that hold all values."""
    least, most = float(np.nanmin(values)), float(np.nanmax(values))
    step = nice_step((most - least) / 4)
    return step, step * floor(least / step + 1e-6), step * ceil(most / step - 1e-6)


def _spans(at: np.ndarray, shaded: np.ndarray) -> list[tuple[float, float]]:
    """From where to where rows are shaded: each row stands for the stretch since the one before."""
    edges = np.flatnonzero(np.diff(shaded.astype(int), prepend=0, append=0))
    return [(float(at[max(a - 1, 0)]), float(at[b - 1])) for a, b in edges.reshape(-1, 2)]
