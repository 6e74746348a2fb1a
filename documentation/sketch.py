"""What the drawings have in common: bare axes, labels with a white rim, arrows, arcs of angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import TypeAlias

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    Place: TypeAlias = Sequence[float] | np.ndarray

INK, MUTED, BLUE, RED, GREEN, PALE = (
    "#1e2a36",
    "#6b7785",
    "#0b5fa5",
    "#c1440e",
    "#0b6e4f",
    "#c9d1d9",
)


def bare(figure: Figure) -> Axes:
    """Axes of equal scales without a frame."""
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def pair(at: Place) -> tuple[float, float]:
    """A point as matplotlib wants it."""
    return float(at[0]), float(at[1])


def label(axes: Axes, at: Place, text: str, shift: tuple[float, float], **look: object) -> None:
    """Words beside a point, `shift` in points of the page."""
    from matplotlib.patheffects import withStroke

    shown = {"color": INK, "fontsize": 10, "ha": "center", "va": "center", **look}
    rim = [withStroke(linewidth=3, foreground="white")]
    axes.annotate(
        text,
        pair(at),
        xytext=shift,
        textcoords="offset points",
        path_effects=rim,
        zorder=9,
        **shown,
    )


def disc(axes: Axes, at: Place, number: str, shift: tuple[float, float] = (0, 0)) -> None:
    """A number, white in a filled circle."""
    box = {"boxstyle": "circle,pad=0.25", "facecolor": BLUE, "edgecolor": "white"}
    look = {"ha": "center", "va": "center", "fontsize": 9, "color": "white", "bbox": box}
    axes.annotate(number, pair(at), xytext=shift, textcoords="offset points", zorder=9, **look)


def arrow(axes: Axes, start: Place, end: Place, colour: str = INK, style: str = "-|>") -> None:
    """An arrow from one point to another."""
    look = {"arrowstyle": style, "color": colour, "lw": 1.3, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", pair(end), xytext=pair(start), arrowprops=look, zorder=7)


def arc(
    axes: Axes, centre: np.ndarray, radius: float, start: float, end: float, colour: str = RED
) -> None:
    """An angle from `start` to `end` [rad], an arrow head at its end."""
    turn = np.linspace(start, end, 40)
    x, y = centre[:, None] + radius * np.stack([np.cos(turn), np.sin(turn)])
    axes.plot(x, y, color=colour, lw=1.2, zorder=6)
    arrow(axes, (x[-3], y[-3]), (x[-1], y[-1]), colour)


def level(axes: Axes, at: np.ndarray, length: float) -> None:
    """A dashed line to the right, from which an angle is counted."""
    axes.plot([at[0], at[0] + length], [at[1]] * 2, color=MUTED, lw=0.9, ls=(0, (4, 3)), zorder=2)


def frame(axes: Axes, at: np.ndarray, length: float, names: tuple[str, str]) -> None:
    """Two axes, to the right and up, with their names."""
    for way, name, shift in (((1, 0), names[0], (6, 8)), ((0, 1), names[1], (0, 8))):
        end = at + length * np.array(way)
        arrow(axes, at, end, GREEN)
        label(axes, end, name, shift, color=GREEN)


def ground(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    """The ground's line, and shade below it."""
    axes.plot(x, y, color=INK, lw=1.6, zorder=3)
    axes.fill_between(x, y, y - 0.05 * (x[-1] - x[0]), color="#e9edf1", lw=0, zorder=1)
