"""Friction cone and ground force at the supporting foot."""

from __future__ import annotations

from math import atan, cos, hypot, pi, sin
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.arrow import arrow

if TYPE_CHECKING:
    from matplotlib.transforms import Affine2D

    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.canvas import Box, Canvas, Place

WEIGHT_LENGTH = 0.26
"""Length of the arrow of a force that equals the robot's weight, in robot heights."""
LONGEST = 0.9
CONE_LENGTH = 0.36


class Contact:
    """A cone of half-angle atan(mu) and the ground's force, both from the zero-moment point.

    The arrow is green while the foot holds and vermilion while it slides; the cone's outline is
    the static friction, the dashes inside it the kinetic one where that is smaller.
    """

    def __init__(self, canvas: Canvas, view: Affine2D, clip: Box, *, weight: float, height: float):
        self._canvas, self._height = canvas, height
        self._weight = self._usual = weight
        self._place: Place = {"view": view, "clip": clip}
        self._cone = canvas.area([], theme.HOLDS, edge=theme.HOLDS, width=0.8, **self._place)
        self._kinetic = canvas.lines([], theme.SLIDES, 1.2, **self._place)
        self._kinetic.set_linestyle([(0, (3.0, 2.4))])

    def weigh(self, weight: float | None) -> None:
        """Measure forces by this weight from now on [N]; by the usual one where it is None."""
        self._weight = self._usual if weight is None else weight

    def add_arrow(self) -> None:
        """The force itself, drawn over what was added to the canvas before."""
        self._arrow = self._canvas.area([], theme.HOLDS, edge=theme.PAGE, width=1.4, **self._place)
        self._foot = self._canvas.dots(theme.PAGE, 6.5, 1.2, fill=theme.HOLDS, **self._place)

    def move(self, frame: BipedFrame, surface: float, scale: float) -> None:
        """Show a frame's contact on a floor at height `surface` [m], `scale` page units a metre."""
        apex = np.array([frame.floor_position + frame.zmp, surface])
        colour = theme.HOLDS if frame.sticking else theme.SLIDES
        self._move_cone(frame, apex, colour)
        force = np.array([frame.friction_force, frame.normal_force])
        length = hypot(*force) / self._weight * WEIGHT_LENGTH if self._weight > 0 else 0.0
        length = min(length, LONGEST) * self._height
        self._arrow.set_facecolor(colour)
        self._arrow.set_verts([arrow(apex, force, length, scale)] if length > 0 else [])
        self._foot.set_markerfacecolor(colour)
        self._foot.set_data(*apex[:, None])

    def _move_cone(self, frame: BipedFrame, apex: np.ndarray, colour: str) -> None:
        if frame.mu_static is None:
            self._cone.set_verts([])
            self._kinetic.set_segments([])
            return
        reach, half = CONE_LENGTH * self._height, atan(frame.mu_static)
        angles = np.linspace(pi / 2 - half, pi / 2 + half, 17)
        rim = apex + reach * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        self._cone.set_verts([np.concatenate([apex[None], rim])])
        self._cone.set_facecolor((colour, 0.16))
        self._cone.set_edgecolor((colour, 0.75))
        inner = []
        if frame.mu_kinetic is not None and frame.mu_kinetic < frame.mu_static:
            half = atan(frame.mu_kinetic)
            ends = [apex + reach * np.array([side * sin(half), cos(half)]) for side in (-1, 1)]
            inner = [(apex, end) for end in ends]
        self._kinetic.set_segments(inner)
