"""A page to draw on: matplotlib's Agg canvas with a still background and moving artists."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias, TypedDict, TypeVar, Unpack

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.lettering import Lettering, Words

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.font_manager import FontProperties
    from matplotlib.lines import Line2D
    from matplotlib.patches import FancyBboxPatch
    from matplotlib.transforms import Affine2D, Transform
    from matplotlib.typing import ColorType, LineStyleType
    from numpy.typing import ArrayLike

    Colours: TypeAlias = ColorType | Sequence[ColorType]

A = TypeVar("A", bound="Artist")
Box = tuple[float, float, float, float]
"""Left, bottom, right, top in page units."""


class Place(TypedDict, total=False):
    """Where an artist is: in a view's world, by default on the page, and cut off at a box."""

    view: Transform | None
    clip: Box | None


class Look(TypedDict, total=False):
    """More of how a curve looks."""

    solid_joinstyle: Literal["miter", "round", "bevel"]
    markersize: float
    markerfacecolor: ColorType
    markeredgecolor: ColorType
    markeredgewidth: float


class Canvas:
    """A picture of `width` x `height` pixels, measured in page units with y upwards.

    The page is 960 x 540 units at the default size and grows with the picture; line widths and
    letters are in the same units. Still artists are drawn once, moving ones for every picture, both
    in the order in which they were added. Fonts, colours and widths are all given, so that the
    user's matplotlib settings do not matter, and no state is shared with pyplot.
    """

    def __init__(self, width: int, height: int):
        agg = require("matplotlib.backends.backend_agg")
        transforms = require("matplotlib.transforms")
        self.unit = min(width / 960, height / 540)
        self.width, self.height = width / self.unit, height / self.unit
        dpi = 72 * self.unit  # so that a point is a page unit
        self._figure = require("matplotlib.figure").Figure((width / dpi, height / dpi), dpi=dpi)
        self._agg = agg.FigureCanvasAgg(self._figure)
        self._renderer = self._agg.get_renderer()
        self.page: Transform = transforms.Affine2D().scale(self.unit)
        self._still: list[Artist] = []
        self._moving: list[Artist] = []
        self._background = None
        self._pixels = height, width
        self._words: list[Words] = []
        self._still_words: list[Words] = []
        self._lettering = Lettering(width, self.unit, _fonts())
        self.area([self.corners((0, 0, self.width, self.height))], theme.PAGE, still=True)

    @staticmethod
    def corners(box: Box) -> list[tuple[float, float]]:
        """The box's outline, anticlockwise."""
        left, bottom, right, top = box
        return [(left, bottom), (right, bottom), (right, top), (left, top)]

    def view(self) -> Affine2D:
        """A transform from a world to the page that can be moved: `set_matrix` on it."""
        return require("matplotlib.transforms").Affine2D()

    def lines(
        self,
        segments: Sequence[ArrayLike],
        colour: Colours,
        width: float | Sequence[float] = 1.0,
        *,
        cap: str = "round",
        still: bool = False,
        **place: Unpack[Place],
    ) -> LineCollection:
        """Separate straight or bent lines; `set_segments` moves them."""
        artist = require("matplotlib.collections").LineCollection(
            segments, colors=colour, linewidths=width, capstyle=cap, joinstyle="round"
        )
        return self._add(artist, still, **place)

    def curve(
        self,
        colour: ColorType,
        width: float,
        *,
        dashes: LineStyleType = "-",
        marker: str = "",
        view: Transform | None = None,
        clip: Box | None = None,
        **look: Unpack[Look],
    ) -> Line2D:
        """One curve, or one marker at each of its points; `set_data` moves it."""
        artist = require("matplotlib.lines").Line2D(
            [], [], color=colour, linewidth=width, linestyle=dashes, marker=marker, **look
        )
        return self._add(artist, False, view=view, clip=clip)

    def dots(
        self,
        edge: str,
        size: float,
        width: float,
        *,
        fill: str = theme.PAGE,
        **place: Unpack[Place],
    ) -> Line2D:
        """A round marker at each of its points, with an edge; `set_data` moves them."""
        look = Look(
            markersize=size, markerfacecolor=fill, markeredgecolor=edge, markeredgewidth=width
        )
        return self.curve("none", 0, marker="o", **look, **place)

    def area(
        self,
        outlines: Sequence[ArrayLike],
        colour: Colours,
        *,
        edge: Colours = "none",
        width: float = 0.0,
        alpha: float | None = None,
        still: bool = False,
        **place: Unpack[Place],
    ) -> PolyCollection:
        """Filled polygons; `set_verts` moves them."""
        artist = require("matplotlib.collections").PolyCollection(
            outlines, facecolors=colour, edgecolors=edge, linewidths=width, alpha=alpha
        )
        artist.set_joinstyle("round")
        return self._add(artist, still, **place)

    def rounded(
        self, box: Box, colour: str, radius: float, *, still: bool = False
    ) -> FancyBboxPatch:
        """A filled box with round corners."""
        patches = require("matplotlib.patches")
        left, bottom, right, top = box
        style = patches.BoxStyle("Round", pad=0, rounding_size=radius)
        artist = patches.FancyBboxPatch(
            (left, bottom), right - left, top - bottom, boxstyle=style, fc=colour, ec="none"
        )
        return self._add(artist, still)

    def text(
        self,
        x: float,
        y: float,
        words: str = "",
        size: float = theme.LABEL,
        colour: str = theme.INK,
        *,
        bold: bool = False,
        align: str = "left",
        still: bool = False,
        view: Transform | None = None,
        clip: Box | None = None,
    ) -> Words:
        """A line of text on a baseline; moving ones lie over everything else."""
        if clip is not None:
            left, bottom, right, top = (round(side * self.unit) for side in clip)
            clip = left, self._pixels[0] - top, right, self._pixels[0] - bottom
        transform = self.page if view is None else view + self.page
        artist = Words(
            self._lettering,
            transform,
            (x, y),
            words,
            size,
            colour,
            bold=bold,
            align=align,
            clip=clip,
        )
        (self._still_words if still else self._words).append(artist)
        return artist

    def forget_background(self) -> None:
        """Draw the still artists anew in the next picture."""
        self._background = None

    def picture(self) -> np.ndarray:
        """Draw everything: uint8 [height, width, 3], a fresh array."""
        if self._background is None:
            self._renderer.clear()
            for artist in self._still:
                artist.draw(self._renderer)
            self._write(self._still_words)
            self._background = self._agg.copy_from_bbox(self._figure.bbox)
        self._agg.restore_region(self._background)
        for artist in self._moving:
            artist.draw(self._renderer)
        self._write(self._words)
        return np.array(np.asarray(self._renderer.buffer_rgba())[:, :, :3], order="C")

    def _write(self, words: list[Words]) -> None:
        pixels = np.asarray(self._renderer.buffer_rgba())
        for each in words:
            each.paint(pixels)

    def _add(
        self, artist: A, still: bool, *, view: Transform | None = None, clip: Box | None = None
    ) -> A:
        artist.set_figure(self._figure)
        artist.set_transform(self.page if view is None else view + self.page)
        if clip is not None:
            transforms = require("matplotlib.transforms")
            box = transforms.Bbox.from_extents(*(side * self.unit for side in clip))
            artist.set_clip_box(box)
            artist.set_clip_on(True)
        (self._still if still else self._moving).append(artist)
        return artist


def _fonts() -> dict[bool, FontProperties]:
    """The plain and the bold letters that come with matplotlib."""
    folder = Path(require("matplotlib").get_data_path()) / "fonts" / "ttf"
    properties = require("matplotlib.font_manager").FontProperties
    names = {False: "DejaVuSans.ttf", True: "DejaVuSans-Bold.ttf"}
    return {bold: properties(fname=folder / name) for bold, name in names.items()}
