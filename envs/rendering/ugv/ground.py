"""The ground that the UGV drives over, with a scale in metres."""

from __future__ import annotations

from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.lettering import written
from stickslip.envs.rendering.ticks import nice_step

if TYPE_CHECKING:
    from matplotlib.transforms import Affine2D

    from stickslip.envs.rendering.canvas import Box, Canvas, Place
    from stickslip.envs.rendering.ugv.frame import UGVFrame


class Ground:
    """The profile, filled below, coloured by its friction; the points that are observed ahead."""

    def __init__(self, canvas: Canvas, view: Affine2D, panel: Box):
        self._panel = panel
        left, bottom, right, _ = panel
        place: Place = {"view": view, "clip": panel}
        self._fill = canvas.area([], theme.floor_colour(0.8), **place)
        self._surface = canvas.curve(theme.INK, 1.6, solid_joinstyle="round", **place)
        self._seen = canvas.dots(theme.MOTOR, 5.0, 1.4, **place)
        beside = (left, bottom - 8, right, bottom)
        self._ticks = canvas.lines([], theme.MUTED, 1.0, cap="butt", clip=beside)
        self._numbers = [
            canvas.text(0, bottom - 19, "", theme.SMALL, theme.MUTED, align="center")
            for _ in range(16)
        ]
        self._label = canvas.text(left + 12, bottom + 8, "", theme.LABEL, clip=panel)

    def move(self, frame: UGVFrame, left: float, right: float, depth: float) -> None:
        """Show the stretch from left to right, filled down to the height `depth` [m]."""
        x, y = frame.ground.T
        self._surface.set_data(x, y)
        self._seen.set_data(*frame.preview.T)
        parts = alike(len(frame.ground), frame.ground_mu, frame.mu)
        self._fill.set_verts([_down_to(depth, frame.ground[a:b]) for a, b, _ in parts])
        self._fill.set_facecolor([theme.floor_colour(mu) for *_, mu in parts])
        ends = min(mu for *_, mu in parts), max(mu for *_, mu in parts)
        self._label.words = " to ".join(f"{one:.3g}" for one in sorted({*ends}))
        self._label.words = f"μ {self._label.words}"
        self._move_scale(left, right)

    def _move_scale(self, left: float, right: float) -> None:
        bottom = self._panel[1]
        scale = (self._panel[2] - self._panel[0]) / (right - left)
        step = nice_step((right - left) / 8)
        marks = [step * i for i in range(ceil(left / step), floor(right / step) + 1)]
        places = [self._panel[0] + (x - left) * scale for x in marks]
        self._ticks.set_segments([[(at, bottom), (at, bottom - 5)] for at in places])
        digits = max(0, -floor(np.log10(step) + 1e-9))
        for number in self._numbers:
            number.visible = False
        room = [
            pair
            for pair in zip(marks, places, strict=True)
            if self._panel[0] + 14 <= pair[1] <= self._panel[2] - 14
        ]
        for number, (x, at) in zip(self._numbers, room, strict=False):
            number.x = at
            number.words = f"{written(x, digits)} m"
            number.visible = True


def alike(count: int, ground_mu: np.ndarray | None, mu: float) -> list[tuple[int, int, float]]:
    """Stretches of the ground's points of one friction: first, one past the last, and mu.

    ground_mu: at each of `count` points, None where it is mu everywhere.
    """
    if ground_mu is None:
        return [(0, count, mu)]
    each = np.round(ground_mu, 3)
    starts = [0, *(np.flatnonzero(np.diff(each)) + 1).tolist()]
    ends = [*(start + 1 for start in starts[1:]), len(each)]  # each reaches the next one
    return [(a, b, float(each[a])) for a, b in zip(starts, ends, strict=True)]


def _down_to(depth: float, points: np.ndarray) -> np.ndarray:
    """The outline of a stretch filled down to that height."""
    ends = np.array([[points[-1, 0], depth], [points[0, 0], depth]])
    return np.concatenate([points, ends])
