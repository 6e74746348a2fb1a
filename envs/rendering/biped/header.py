"""Numbers of the moment above the picture, and what the colours mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.board import Board, draw_entries
from stickslip.envs.rendering.lettering import brief, written

if TYPE_CHECKING:
    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.canvas import Box, Canvas

TITLES = (
    ("time  [s]", 0.0),
    ("walked  [m]", 0.18),
    ("steps", 0.35),
    ("mean rate  [rad/s]", 0.465),
    ("friction / normal", 0.715),
)


class Header(Board):
    """Five numbers and a badge that says whether the foot sticks, slips or the walk has ended."""

    def __init__(self, canvas: Canvas, box: Box):
        super().__init__(canvas, box, TITLES)

    def move(self, frame: BipedFrame, walked: float) -> None:
        """Show a frame; walked: how far [m]."""
        use = (
            written(abs(frame.friction_force) / frame.normal_force, 2)
            if frame.normal_force > 0
            else "–"
        )
        words = (
            written(frame.time, 2),
            written(walked, 2),
            f"{frame.steps}",
            brief(frame.mean_crank_rate),
            use if frame.mu_static is None else f"{use} of {frame.mu_static:.2f}",
        )
        if frame.status.lower() not in ("ok", "slip_onset"):
            self.show(words, frame.status.replace("_", " ").upper(), theme.INK)
        elif frame.sticking:
            self.show(words, "STICK", theme.HOLDS)
        else:
            self.show(words, "SLIP", theme.SLIDES)


def draw_key(canvas: Canvas, left: float, top: float) -> None:
    """What colours, letters and marks stand for, in the still background."""
    entries = (
        (theme.SUPPORT["main"], "supporting leg"),
        (theme.SWING["main"], "swinging leg"),
        (theme.HIP_EDGE, "hip and its slot: A crank, B rocker,"),
        (None, "D tendons"),
        (theme.MOTOR, "crank and motor"),
        (theme.HOLDS, "foot sticks: ground force and its cone,"),
        (None, "both from the zero-moment point"),
        (theme.SLIDES, "foot slips; on the floor how far"),
        (None, "each time, either way"),
    )
    last = draw_entries(canvas, entries, left, top)
    dashes = [[(left + a, last), (left + b, last)] for a, b in ((3, 8), (12, 17))]
    canvas.lines(dashes, theme.SLIDES, 1.6, still=True)
    canvas.text(
        left + 26, last - 4, "cone of kinetic friction", theme.SMALL, theme.MUTED, still=True
    )
