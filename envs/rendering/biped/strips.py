"""Torque, crank rate and slide of the biped over the last seconds."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.lettering import brief, written
from stickslip.envs.rendering.strips import KEPT_ROWS, SPAN, Strip, draw_axis, strip_boxes

if TYPE_CHECKING:
    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.canvas import Box, Canvas


class Row(NamedTuple):
    """What the strips remember of a frame."""

    time: float
    torque: float
    crank_rate: float
    commanded_rate: float
    slide: float
    sliding: bool


class History:
    """The last seconds of a walk. A frame of an earlier time starts a new one."""

    def __init__(self):
        self._rows: deque[Row] = deque(maxlen=KEPT_ROWS)

    def forget(self) -> None:
        self._rows.clear()

    def is_before(self, time: float) -> bool:
        """Whether all that is remembered happened at or before `time` [s]."""
        return not self._rows or self._rows[-1].time <= time

    def record(self, frame: BipedFrame) -> None:
        """Add a frame; one of the same time as the last takes its place."""
        if self._rows and self._rows[-1].time == frame.time:
            self._rows.pop()
        commanded = np.nan if frame.commanded_rate is None else frame.commanded_rate
        self._rows.append(
            Row(
                frame.time,
                frame.torque,
                frame.crank_rate,
                commanded,
                1000 * frame.slide,
                not frame.sticking,
            )
        )
        while len(self._rows) > 1 and self._rows[1].time <= frame.time - SPAN:
            self._rows.popleft()

    def columns(self) -> np.ndarray:
        """[6, n]: Row's fields, time counted from now [s], slide in mm, forwards positive."""
        columns = np.array(self._rows, dtype=float).T
        columns[0] -= columns[0, -1]
        return columns


class Strips:
    """Three strips above each other with one time axis; slides are shaded in all of them."""

    def __init__(self, canvas: Canvas, box: Box, torque_limit: float):
        boxes = strip_boxes(box)
        self._torque = Strip(canvas, boxes[0], "motor torque", "N m", theme.MOTOR)
        self._rate = Strip(canvas, boxes[1], "crank rate", "rad/s", theme.MOTOR, second=True)
        self._slide = Strip(canvas, boxes[2], "slide, forwards +", "mm", theme.SLIDES)
        self._limit = torque_limit
        draw_axis(canvas, boxes[2])

    def move(self, history: History, frame: BipedFrame) -> None:
        """Show a history whose last row is `frame`."""
        time, torque, rate, commanded, slide, sliding = history.columns()
        spans = _spans(time, sliding > 0)
        self._torque.move(time, torque, spans, brief(frame.torque), (-self._limit, self._limit))
        asked = frame.commanded_rate
        self._rate.aside = "" if asked is None else f"asked {brief(asked)}"
        self._rate.move(time, rate, spans, brief(frame.crank_rate), (0.0, 1.0), commanded)
        self._slide.move(time, slide, spans, written(1000 * frame.slide, 1), (0.0, 1.0))


def _spans(time: np.ndarray, sliding: np.ndarray) -> list[tuple[float, float]]:
    """From when to when the foot slid [s]: each frame stands for the time since the one before."""
    edges = np.flatnonzero(np.diff(sliding.astype(int), prepend=0, append=0))
    return [(float(time[max(a - 1, 0)]), float(time[b - 1])) for a, b in edges.reshape(-1, 2)]
