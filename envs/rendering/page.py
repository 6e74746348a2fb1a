"""What is where in the picture of every machine: a panel, numbers above it, strips beside it."""

from __future__ import annotations

from typing import NamedTuple

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.canvas import Box, Canvas
from stickslip.envs.rendering.strips import TITLE


class Page(NamedTuple):
    """A canvas with an empty panel, and the places of all on it."""

    canvas: Canvas
    panel: Box
    header: Box
    strips: Box


def make_page(width: int, height: int) -> Page:
    """A page of width x height [px]; ValueError if it is too small to read."""
    if width < 480 or height < 270:
        raise ValueError(
            f"a picture of {width} x {height} is too small to read; accepted: width >= 480, "
            "height >= 270"
        )
    canvas = Canvas(width, height)
    left, bottom = theme.MARGIN, theme.MARGIN + theme.FOOTER
    right, top = canvas.width - theme.MARGIN, canvas.height - theme.MARGIN
    edge = right - theme.COLUMN
    panel = (left, bottom, edge, top - theme.HEADER - 10)
    canvas.area([canvas.corners(panel)], theme.PANEL, still=True)
    header = (left, top - theme.HEADER, edge, top)
    return Page(canvas, panel, header, (edge + 52, bottom, right, top + TITLE - 18))
