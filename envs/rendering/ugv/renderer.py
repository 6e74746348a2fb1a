"""Pictures of the UGV driving."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.board import draw_entries
from stickslip.envs.rendering.page import make_page
from stickslip.envs.rendering.ugv.ground import Ground
from stickslip.envs.rendering.ugv.panels import UGVHeader, UGVStrips
from stickslip.envs.rendering.ugv.vehicle import Forces, Vehicle

if TYPE_CHECKING:
    from stickslip.dynamics.ugv import UGVParams
    from stickslip.envs.rendering.ugv.frame import UGVFrame

SPAN = 2.9
"""Width of the picture in lengths of the vehicle: of its body and both legs."""
KEY = (
    (theme.HIP_EDGE, "body"),
    (theme.SUPPORT["mid"], "legs"),
    (theme.MOTOR, "motors; ground seen ahead"),
    (theme.HOLDS, "wheel grips (force, cone)"),
    (theme.SLIDES, "wheel slips"),
)


class UGVRenderer:
    """Draws frames of one vehicle, without a display.

    vehicle: one, not a batch. criterion, unit: of the cost in the header. width, height: of the
    picture [px].

    The camera goes along with the vehicle, so a picture depends on its frame alone, but for the
    strips, which remember the frames since `reset`. Needs the extra `viz`.
    """

    def __init__(
        self,
        vehicle: UGVParams,
        criterion: str = "cost",
        unit: str = "-",
        *,
        width: int = 960,
        height: int = 540,
    ):
        page = make_page(width, height)
        if any(np.ndim(value) for value in (vehicle.body_length, vehicle.wheel_radius)):
            raise ValueError("vehicle holds a batch; accepted: one vehicle")
        self._canvas, self._panel = canvas, panel = page.canvas, page.panel
        length, radius = float(vehicle.body_length), float(vehicle.wheel_radius)
        reach = length + 2 * float(vehicle.leg_length)
        self._span = SPAN * reach
        self._scale = (panel[2] - panel[0]) / self._span
        draw_entries(canvas, KEY, panel[0] + 12, panel[3] - 18)
        self._view = canvas.view()
        self._ground = Ground(canvas, self._view, panel)
        self._forces = Forces(canvas, self._view, panel, weight=float(vehicle.weight))
        self._vehicle = Vehicle(canvas, self._view, panel, radius=radius, length=length)
        self._forces.add_arrows()
        self._header = UGVHeader(canvas, page.header, criterion, unit)
        self._strips = UGVStrips(canvas, page.strips)

    @property
    def span(self) -> float:
        """How much of the ground a picture shows [m]."""
        return self._span

    def reset(self) -> None:
        """Forget the history: empty strips."""
        self._strips.forget()

    def draw(self, frame: UGVFrame) -> np.ndarray:
        """The picture of a frame: uint8 [height, width, 3], a fresh array."""
        left, right, bottom = self._move_camera(frame)
        self._ground.move(frame, left, right, bottom)
        self._forces.move(frame, self._scale)
        self._vehicle.move(frame)
        self._header.move(frame)
        self._strips.move(frame)
        return self._canvas.picture()

    def _move_camera(self, frame: UGVFrame) -> tuple[float, float, float]:
        """Keep the vehicle left of the middle; the shown stretch and the lowest height [m]."""
        left, bottom, _, top = self._panel
        middle = (frame.rear.contact + frame.front.contact) / 2
        start = float(middle[0]) - 0.42 * self._span
        low = float(middle[1]) - 0.26 * (top - bottom) / self._scale
        across, up = left - self._scale * start, bottom - self._scale * low
        self._view.set_matrix(np.array([[self._scale, 0, across], [0, self._scale, up], [0, 0, 1]]))
        return start, start + self._span, low - 1.0
