"""Numbers of the moment above the UGV's picture, and strips over the way beside it."""

from __future__ import annotations

from collections import deque
from math import degrees
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.board import Board
from stickslip.envs.rendering.lettering import brief, written
from stickslip.envs.rendering.strips import KEPT_ROWS, SPAN, Strip, draw_axis, strip_boxes

if TYPE_CHECKING:
    from stickslip.envs.rendering.canvas import Box, Canvas
    from stickslip.envs.rendering.ugv.frame import UGVFrame


class UGVHeader(Board):
    """Five numbers and a badge that says whether the wheels grip or how the drive has ended."""

    def __init__(self, canvas: Canvas, box: Box, criterion: str, unit: str):
        cost = criterion.replace("_", " ") + ("" if unit == "-" else f"  [{unit}]")
        titles = (
            ("driven  [m]", 0.0),
            (cost, 0.17),
            ("torque  [N m]", 0.44),
            ("pitch  [°]", 0.615),
            ("friction / normal", 0.745),
        )
        super().__init__(canvas, box, titles)

    def move(self, frame: UGVFrame) -> None:
        """Show a frame."""
        demand = written(frame.demand, 2) if np.isfinite(frame.demand) else "–"
        words = (
            written(frame.x - frame.start, 2),
            brief(frame.cost),
            brief(frame.torque),
            written(degrees(frame.pitch), 1),
            f"{demand} of {frame.mu:.2f}",
        )
        ended = frame.status != "ok"
        colour = theme.SLIDES if frame.slips else theme.INK if ended else theme.HOLDS
        badge = frame.status.upper() if ended else "SLIP" if frame.slips else "GRIP"
        self.show(words, badge, colour)


class UGVStrips:
    """Torque, leg angles and grip over the last metres, above each other with one axis."""

    def __init__(self, canvas: Canvas, box: Box):
        boxes = strip_boxes(box)
        self._torque = Strip(canvas, boxes[0], "torque on each wheel", "N m", theme.MOTOR)
        self._legs = Strip(canvas, boxes[1], "legs", "°", theme.HOLDS, second=True)
        self._legs.aside = "rear, front dashed"
        self._grip = Strip(canvas, boxes[2], "margin of grip", "kN", theme.SLIDES)
        draw_axis(canvas, boxes[2], "m")
        self._rows: deque[tuple[float, ...]] = deque(maxlen=KEPT_ROWS)

    def forget(self) -> None:
        """Empty strips."""
        self._rows.clear()

    def move(self, frame: UGVFrame) -> None:
        """Add a frame and show the last metres. One further back begins anew."""
        if self._rows and self._rows[-1][0] > frame.x:
            self.forget()
        if self._rows and self._rows[-1][0] == frame.x:
            self._rows.pop()
        rear, front = degrees(frame.rear.leg_angle), degrees(frame.front.leg_angle)
        self._rows.append((frame.x, frame.torque, rear, front, frame.grip / 1000))
        while len(self._rows) > 1 and self._rows[1][0] <= frame.x - SPAN:
            self._rows.popleft()
        x, torque, rears, fronts, grip = np.array(self._rows, float).T
        x = x - x[-1]
        self._torque.move(x, torque, [], brief(frame.torque), (-50.0, 50.0))
        self._legs.move(x, rears, [], written(rear, 0), (60.0, 120.0), fronts)
        self._grip.move(x, grip, [], written(frame.grip / 1000, 2), (0.0, 1.0))
