"""Where the supporting foot slid."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.transforms import Affine2D

    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.canvas import Box, Canvas, Place

LEAST_SLIDE = 1e-5
"""A slide shorter than this leaves no mark [m]."""
KEPT_MARKS = 400
THICKNESS = 5.0
LABEL_ROOM = 46.0


class SlipMarks:
    """Where the supporting foot slid so far: one mark for each slide of one foothold."""

    def __init__(self, most: int | None = KEPT_MARKS):
        self._marks: deque[tuple[int, float, float]] = deque(maxlen=most)
        self._slide: float | None = None

    def __iter__(self) -> Iterator[tuple[int, float, float]]:
        """Steps before the slide, and from where to where it went [m], the oldest first."""
        return iter(self._marks)

    def __len__(self) -> int:
        return len(self._marks)

    def record(self, frame: BipedFrame) -> tuple[float, float] | None:
        """Add what the foot slid since the last frame, and return it; None where it did not."""
        slid = 0.0 if self._slide is None else frame.slide - self._slide
        self._slide = frame.slide
        if abs(slid) < LEAST_SLIDE:
            return None
        here = frame.floor_position
        new = low, high = min(here, here - slid), max(here, here - slid)
        if self._marks:
            steps, start, end = self._marks[-1]
            if steps == frame.steps and low <= end + LEAST_SLIDE and high >= start - LEAST_SLIDE:
                self._marks.pop()
                low, high = min(low, start), max(high, end)
        self._marks.append((frame.steps, low, high))
        return new


class SlipTrace:
    """Marks on the floor where the supporting foot slid, each with its length."""

    def __init__(self, canvas: Canvas, view: Affine2D, panel: Box, surface: float, depth: float):
        self._panel, self._surface = panel, surface
        below = panel[1] + depth - THICKNESS - 13
        place: Place = {"view": view, "clip": panel}
        self._smears = canvas.lines([], [theme.SLIDES], THICKNESS, cap="butt", **place)
        self._labels = [
            canvas.text(0, below, "", theme.SMALL, align="center", clip=panel) for _ in range(8)
        ]
        self.forget()

    def forget(self) -> None:
        """Wipe the floor."""
        self._marks = SlipMarks()

    def record(self, frame: BipedFrame) -> None:
        """Add what the foot slid since the last frame."""
        self._marks.record(frame)

    def move(self, left: float, right: float) -> None:
        """Show the marks between two floor positions [m]."""
        scale = (self._panel[2] - self._panel[0]) / (right - left)
        least = 3 / scale
        shown = [mark for mark in self._marks if mark[2] > left and mark[1] < right]
        segments, y = [], self._surface - 0.5 * THICKNESS / scale
        for _, start, end in shown:
            middle, half = (start + end) / 2, max(end - start, least) / 2
            segments.append([(middle - half, y), (middle + half, y)])
        self._smears.set_segments(segments)
        self._move_labels(shown, left, scale)

    def _move_labels(self, shown: list[tuple[int, float, float]], left: float, scale: float):
        """The lengths of the latest marks that have room for one."""
        taken: list[float] = []
        for label in self._labels:
            label.visible = False
        for _, start, end in reversed(shown):
            place = self._panel[0] + ((start + end) / 2 - left) * scale
            crowded = any(abs(place - other) < LABEL_ROOM for other in taken)
            if end - start < 5e-4 or crowded or len(taken) == len(self._labels):
                continue
            label, length = self._labels[len(taken)], 1000 * (end - start)
            label.words = f"{length:.0f} mm" if length >= 9.95 else f"{length:.1f} mm"
            label.x = place
            label.visible = True
            taken.append(place)
