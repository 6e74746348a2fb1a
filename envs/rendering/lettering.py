"""Words that change from picture to picture, drawn from a store of words drawn before."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from matplotlib.font_manager import FontProperties
    from matplotlib.transforms import Transform

KEPT_WORDS = 1024
_SHARE = {"left": 0.0, "center": 0.5, "right": 1.0}


def written(value: float, digits: int) -> str:
    """A number with a true minus sign, and none before a zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "−")


def brief(value: float) -> str:
    """A number of about three figures: two places below 10, one below 100, none above."""
    size = abs(value)
    return written(value, 2 if size < 9.995 else 1 if size < 99.95 else 0)


class _Shape(NamedTuple):
    """How much of each pixel a word covers."""

    cover: np.ndarray
    """[h, w, 1], 0 to 1."""
    rise: int
    """Pixels from the top row to the baseline."""


class Lettering:
    """Shapes of words. Rasterising letters takes most of a picture's time, so each is kept."""

    def __init__(self, width: int, unit: float, fonts: dict[bool, FontProperties]):
        self._unit, self._fonts = unit, fonts
        self._rise = int(np.ceil(1.5 * theme.VALUE * unit))
        size = width, 2 * self._rise
        figure = require("matplotlib.figure").Figure((size[0] / 72, size[1] / 72), dpi=72)
        agg = require("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
        self._scratch = agg.get_renderer()
        self._text = require("matplotlib.text").Text(0, size[1] - self._rise, "", color="black")
        self._text.set_usetex(False)
        self._text.set_parse_math(False)
        self._text.set_figure(figure)
        self._shapes: dict[tuple[str, float, bool], _Shape] = {}

    def shape(self, words: str, size: float, bold: bool) -> _Shape:
        """The shape of `words` in letters of `size` page units."""
        key = words, size, bold
        shape = self._shapes.get(key)
        if shape is None:
            if len(self._shapes) >= KEPT_WORDS:
                self._shapes.clear()
            shape = self._shapes[key] = self._draw(words, size * self._unit, bold)
        return shape

    def _draw(self, words: str, size: float, bold: bool) -> _Shape:
        self._scratch.clear()
        self._text.set_text(words)
        self._text.set_fontproperties(self._fonts[bold])
        self._text.set_fontsize(size)
        self._text.draw(self._scratch)
        cover = np.asarray(self._scratch.buffer_rgba())[:, :, 3]
        rows, columns = np.flatnonzero(cover.any(1)), np.flatnonzero(cover.any(0))
        if not rows.size:
            return _Shape(np.zeros((1, 1, 1), np.float32), 0)
        ink = cover[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1, None]
        return _Shape(ink / np.float32(255), self._rise - int(rows[0]))


class Words:
    """A line of text that moves: its place, its look and its words."""

    def __init__(
        self,
        lettering: Lettering,
        transform: Transform,
        place: tuple[float, float],
        words: str,
        size: float,
        colour: str,
        *,
        bold: bool,
        align: str,
        clip: tuple[int, int, int, int] | None,
    ):
        self.x, self.y = place
        self.words, self.size, self.bold = words, size, bold
        self.visible = True
        self._lettering, self._transform, self._clip = lettering, transform, clip
        self._share = _SHARE[align]
        self._colour = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], np.float32)

    def paint(self, pixels: np.ndarray) -> None:
        """Lay the words over uint8 [height, width, 3 or 4], row 0 at the top."""
        if not self.visible or not self.words:
            return
        cover, rise = self._lettering.shape(self.words, self.size, self.bold)
        height, width, _ = cover.shape
        x, y = self._transform.transform((self.x, self.y))
        left = round(float(x) - self._share * width)
        top = pixels.shape[0] - round(float(y)) - rise
        low_x, low_y, high_x, high_y = self._clip or (0, 0, pixels.shape[1], pixels.shape[0])
        a, b = max(left, low_x), min(left + width, high_x)
        c, d = max(top, low_y), min(top + height, high_y)
        if a >= b or c >= d:
            return
        under = pixels[c:d, a:b, :3]
        part = cover[c - top : d - top, a - left : b - left]
        under[...] = under + part * (self._colour - under) + np.float32(0.5)
