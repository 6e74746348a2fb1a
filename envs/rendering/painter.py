"""Shapes and words on an array of pixels, by matplotlib's Agg renderer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from stickslip.dynamics.lazily import require
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from matplotlib.backend_bases import GraphicsContextBase
    from matplotlib.font_manager import FontProperties
    from matplotlib.typing import CapStyleType
    from numpy.typing import ArrayLike

    Colour: TypeAlias = str | tuple[str, float] | tuple[float, float, float]

Box: TypeAlias = tuple[float, float, float, float]
"""Left, bottom, right, top [px]."""
MARGIN = 2
"""About the letters of a word [px]."""
SHARES = {"left": 0.0, "center": 0.5, "right": 1.0}


class Painter:
    """A picture of theme.WIDTH x theme.HEIGHT pixels, y upwards.

    Nothing depends on the user's matplotlib settings.
    """

    def __init__(self):
        agg = require("matplotlib.backends.backend_agg")
        self._agg = agg.RendererAgg(theme.WIDTH, theme.HEIGHT, 72)  # a point is a pixel
        self._transform = require("matplotlib.transforms").IdentityTransform()
        self._new_path = require("matplotlib.path").Path
        self._rgba = require("matplotlib.colors").to_rgba
        self._clip: Box | None = None
        self.box((0, 0, theme.WIDTH, theme.HEIGHT), theme.PAGE)

    @contextmanager
    def inside(self, box: Box) -> Iterator[None]:
        """Cut off what is drawn meanwhile at a box."""
        self._clip = box
        yield
        self._clip = None

    def line(
        self,
        points: ArrayLike,
        colour: Colour,
        width: float = 1.0,
        *,
        dashes: Sequence[float] | None = None,
        cap: CapStyleType = "round",
        fill: Colour | None = None,
    ) -> None:
        """Draw a line through points [n, 2]; fill: of the polygon that it closes."""
        path = self._new_path(np.asarray(points, float), closed=fill is not None)
        style = self._style(colour)
        style.set_linewidth(width)
        style.set_capstyle(cap)
        style.set_joinstyle("round")
        if dashes is not None:
            style.set_dashes(0, dashes)
        self._agg.draw_path(
            style, path, self._transform, None if fill is None else self._rgba(fill)
        )

    def area(
        self, outline: ArrayLike, fill: Colour, edge: Colour = "none", width: float = 0.0
    ) -> None:
        """Fill a polygon [n, 2], and draw its edge."""
        corners = np.asarray(outline, float)
        self.line(np.concatenate([corners, corners[:1]]), edge, width, fill=fill)

    def box(self, box: Box, fill: Colour) -> None:
        """Fill a rectangle."""
        left, bottom, right, top = box
        self.area([(left, bottom), (right, bottom), (right, top), (left, top)], fill)

    def badge(self, box: Box, fill: Colour) -> None:
        """Fill a rectangle with round corners."""
        (left, bottom, right, top), radius = box, 6.0
        inner = (left + radius, bottom + radius, right - radius, top - radius)
        self.box(inner, fill)
        corners = [(inner[i], inner[j]) for i, j in ((0, 1), (2, 1), (2, 3), (0, 3), (0, 1))]
        self.line(corners, fill, 2 * radius)

    def dot(self, place: ArrayLike, size: float, fill: Colour, edge: Colour, width: float) -> None:
        """Draw a disc of diameter `size` with an edge."""
        turn = np.linspace(0, 2 * np.pi, 25)[:-1]
        rim = size / 2 * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        self.area(np.asarray(place) + rim, fill, edge, width)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        size: float = theme.LABEL,
        colour: str = theme.INK,
        *,
        bold: bool = False,
        align: str = "left",
    ) -> None:
        """Write a line of text on a baseline."""
        cover, descent = _letters(words, size, bold)
        left = round(x - SHARES[align] * self.width_of(words, size, bold)) - MARGIN
        letters = np.empty((*cover.shape, 4), np.uint8)
        letters[:] = np.round(255 * np.array(self._rgba(colour)))
        letters[..., 3] = cover
        self._agg.draw_image(self._style(colour), left, round(y) - descent, letters[::-1])

    def width_of(self, words: str, size: float, bold: bool = False) -> float:
        """The width of a line of text."""
        return _letters(words, size, bold)[0].shape[1] - 2 * MARGIN

    def picture(self) -> np.ndarray:
        """The picture: uint8 [height, width, 3], a fresh array."""
        return np.array(np.asarray(self._agg.buffer_rgba())[:, :, :3], order="C")

    def _style(self, colour: Colour) -> GraphicsContextBase:
        style = self._agg.new_gc()
        style.set_foreground(self._rgba(colour), isRGBA=True)
        if self._clip is not None:
            box = require("matplotlib.transforms").Bbox.from_extents(*self._clip)
            style.set_clip_rectangle(box)
        return style


@lru_cache(1024)
def _letters(words: str, size: float, bold: bool) -> tuple[np.ndarray, int]:
    """Coverage of each pixel by words of `size` pixels, and rows below the baseline.

    Rasterising letters takes most of a picture's time, so the results are kept.
    """
    agg, font = require("matplotlib.backends.backend_agg").RendererAgg, _fonts()[bold].copy()
    font.set_size(size)
    width, height, depth = agg(1, 1, 72).get_text_width_height_descent(words, font, False)
    page = agg(ceil(width) + 2 * MARGIN, ceil(height) + 2 * MARGIN, 72)
    descent = ceil(depth) + MARGIN
    page.draw_text(page.new_gc(), MARGIN, page.height - descent, words, font, 0.0)
    return np.array(np.asarray(page.buffer_rgba())[:, :, 3]), descent


@cache
def _fonts() -> dict[bool, FontProperties]:
    """The plain and the bold letters that come with matplotlib."""
    folder = Path(require("matplotlib").get_data_path()) / "fonts" / "ttf"
    properties = require("matplotlib.font_manager").FontProperties
    names = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
    return {bold: properties(fname=folder / name) for bold, name in names.items()}
