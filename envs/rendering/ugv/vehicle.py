"""The UGV itself: body, legs and wheels, and what the ground exerts on them."""

from __future__ import annotations

from math import atan, hypot, pi
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.arrow import arrow

if TYPE_CHECKING:
    from matplotlib.transforms import Affine2D

    from stickslip.envs.rendering.canvas import Box, Canvas, Place
    from stickslip.envs.rendering.ugv.frame import UGVFrame, WheelFrame

WEIGHT_LENGTH = 1.5
"""Length of the arrow of a force that equals the vehicle's weight [m], for the default size."""
CONE_LENGTH = 0.62
SPOKES = 5
THICK = 0.06
"""Half the drawn thickness of the body, in its length."""


class Vehicle:
    """The artists of the vehicle; all positions come with the frame."""

    def __init__(self, canvas: Canvas, view: Affine2D, clip: Box, *, radius: float, length: float):
        place: Place = {"view": view, "clip": clip}
        self._radius, self._half = radius, THICK * length
        self._tyres = canvas.area([], theme.SUPPORT["main"], edge=theme.PANEL, width=1.2, **place)
        self._rims = canvas.area([], theme.SWING["slim"], **place)
        self._spokes = canvas.lines([], theme.SUPPORT["mid"], 2.0, **place)
        self._body = canvas.area([], theme.HIP, edge=theme.HIP_EDGE, width=1.6, **place)
        legs = [theme.PANEL, theme.SUPPORT["mid"]] * 2
        width = theme.BAR_WIDTH["main"] + 2.0
        self._legs = canvas.lines([], legs, [width + 2 * theme.CASING, width] * 2, **place)
        self._hinges = canvas.dots(theme.HIP_EDGE, 8, 1.8, **place)
        self._hubs = canvas.dots(theme.MOTOR, 8, 2.4, **place)

    def move(self, frame: UGVFrame) -> None:
        """Put everything where the frame has it."""
        wheels = frame.rear, frame.front
        turn = np.linspace(0, 2 * pi, 49)
        rim = self._radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        self._tyres.set_verts([wheel.centre + rim for wheel in wheels])
        self._rims.set_verts([wheel.centre + 0.74 * rim for wheel in wheels])
        self._spokes.set_segments([spoke for wheel in wheels for spoke in self._spokes_of(wheel)])
        self._body.set_verts([self._outline(frame)])
        legs = [np.array([wheel.hinge, wheel.centre]) for wheel in wheels]
        self._legs.set_segments([leg for leg in legs for _ in range(2)])
        self._hinges.set_data(*np.array([wheel.hinge for wheel in wheels]).T)
        self._hubs.set_data(*np.array([wheel.centre for wheel in wheels]).T)

    def _spokes_of(self, wheel: WheelFrame) -> list[np.ndarray]:
        angles = wheel.turned + 2 * pi / SPOKES * np.arange(SPOKES)
        ends = 0.74 * self._radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return [np.array([wheel.centre, wheel.centre + end]) for end in ends]

    def _outline(self, frame: UGVFrame) -> np.ndarray:
        return body_corners(frame.rear.hinge, frame.front.hinge, self._half)


def body_corners(a: np.ndarray, b: np.ndarray, h: float) -> np.ndarray:
    """Outline [5, 2] of the body about the hinges a and b, flattened at the front's upper corner;
    h: half its thickness [m]."""
    along = (b - a) / hypot(*(b - a))
    up = np.array([-along[1], along[0]])
    corners = ((-h, -h), (h, -h), (1.4 * h, 0.2 * h), (-0.2 * h, 1.8 * h), (-h, 1.8 * h))
    ends = (a, b, b, b, a)
    return np.array([end + x * along + y * up for end, (x, y) in zip(ends, corners, strict=True)])


class Forces:
    """At each contact a cone of half-angle atan(mu) about the ground's normal, and the force.

    Green while the wheel grips, vermilion where its friction is used up.
    """

    def __init__(self, canvas: Canvas, view: Affine2D, clip: Box, *, weight: float):
        self._canvas, self._weight = canvas, weight
        self._place: Place = {"view": view, "clip": clip}
        self._cones = canvas.area([], theme.HOLDS, edge=theme.HOLDS, width=0.8, **self._place)

    def add_arrows(self) -> None:
        """The forces themselves, drawn over what was added to the canvas before."""
        self._arrows = self._canvas.area([], theme.HOLDS, edge=theme.PAGE, width=1.4, **self._place)

    def move(self, frame: UGVFrame, scale: float) -> None:
        """Show a frame's forces; `scale` page units a metre."""
        wheels = frame.rear, frame.front
        colours = [theme.SLIDES if slipping(frame, wheel) else theme.HOLDS for wheel in wheels]
        cones, arrows = [], []
        for wheel in wheels:
            up = wheel.slope + pi / 2
            half = atan(wheel.mu)
            angles = np.linspace(up - half, up + half, 17)
            rim = CONE_LENGTH * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
            cones.append(np.concatenate([wheel.contact[None], wheel.contact + rim]))
            along = np.array([np.cos(wheel.slope), np.sin(wheel.slope)])
            force = wheel.friction * along + wheel.normal * np.array([-along[1], along[0]])
            length = WEIGHT_LENGTH * hypot(*force) / self._weight
            arrows.append(arrow(wheel.contact, force, length, scale))
        self._cones.set_verts(cones)
        self._cones.set_facecolor([(colour, 0.16) for colour in colours])
        self._cones.set_edgecolor([(colour, 0.75) for colour in colours])
        self._arrows.set_verts(arrows)
        self._arrows.set_facecolor(colours)


def slipping(frame: UGVFrame, wheel: WheelFrame) -> bool:
    """Whether it is the wheel with the lesser margin, once the friction is used up."""
    margins = [one.mu * one.normal - abs(one.friction) for one in (frame.rear, frame.front)]
    own = wheel.mu * wheel.normal - abs(wheel.friction)
    return frame.slips and own <= min(margins)
