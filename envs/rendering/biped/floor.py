"""The floor: its patches with their friction, a scale in metres, and where the foot slid."""

from __future__ import annotations

from math import ceil, floor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.scene import Grip, Patches, Smoothed, Uniform
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.lettering import written
from stickslip.envs.rendering.ticks import nice_step

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.transforms import Affine2D

    from stickslip.dynamics.scene import Scene
    from stickslip.envs.rendering.canvas import Box, Canvas, Place
    from stickslip.envs.rendering.lettering import Words

FAR = 1e4
"""Where the outermost patches end in the picture [m]."""


class Patch(NamedTuple):
    """A stretch of floor [m] with its friction coefficients, None where the foot cannot slip."""

    start: float
    end: float
    mu_static: float | None
    mu_kinetic: float | None

    @property
    def label(self) -> str:
        if self.mu_static is None or self.mu_kinetic is None:
            return "no slip"
        if self.mu_static == self.mu_kinetic:
            return f"μ {self.mu_static:.3g}"
        return f"μₛ {self.mu_static:.3g}   μₖ {self.mu_kinetic:.3g}"


def patches_of(scene: Scene) -> list[Patch]:
    """The floor from left to right as plain numbers."""
    kind = scene.floor
    if isinstance(kind, Grip):
        return [Patch(-np.inf, np.inf, None, None)]
    if isinstance(kind, Smoothed):
        kind = Uniform(kind.mu_kinetic, kind.mu_kinetic)
    edges = np.asarray(kind.edges, float) if isinstance(kind, Patches) else np.empty(0)
    static, kinetic = (np.asarray(mu, float) for mu in (kind.mu_static, kind.mu_kinetic))
    if edges.ndim > 1 or static.ndim > (1 if isinstance(kind, Patches) else 0):
        raise ValueError(
            "scene holds a batch of floors; accepted: one floor, for instance "
            "jax.tree.map(lambda leaf: leaf[0], scene)"
        )
    static, kinetic = (np.broadcast_to(mu, len(edges) + 1).tolist() for mu in (static, kinetic))
    starts, ends = [-np.inf, *edges.tolist()], [*edges.tolist(), np.inf]
    return [Patch(*row) for row in zip(starts, ends, static, kinetic, strict=True)]


class Floor:
    """A band of patches under the feet; world x in metres, `surface` its height in the world."""

    def __init__(
        self, canvas: Canvas, view: Affine2D, panel: Box, scene: Scene, surface: float, depth: float
    ):
        self._canvas, self._panel = canvas, panel
        self._surface, self._depth = surface, depth
        left, bottom, right, _ = panel
        place: Place = {"view": view, "clip": panel}
        self._bands = canvas.area([], theme.PANEL, **place)
        self._glints = canvas.lines([], (1.0, 1.0, 1.0, 0.5), 2.2, cap="butt", **place)
        self._edges = canvas.lines([], theme.PAGE, 2.0, **place)
        canvas.lines([[(-FAR, surface), (FAR, surface)]], theme.INK, 1.6, **place)
        beside = (left, bottom - 8, right, bottom)
        self._ticks = canvas.lines([], theme.MUTED, 1.0, cap="butt", clip=beside)
        self._numbers = [
            canvas.text(0, bottom - 19, "", theme.SMALL, theme.MUTED, align="center")
            for _ in range(16)
        ]
        self._labels: list[Words] = []
        self._usual = tuple(patches_of(scene))
        self._patches: tuple[Patch, ...] = ()
        self.lay(None)

    def lay(self, patches: tuple[Patch, ...] | None) -> None:
        """Show these from now on, from left to right; the scene's where there are None."""
        patches = self._usual if patches is None else patches
        if patches == self._patches:
            return
        self._patches, low, high = patches, self._surface - self._depth, self._surface
        self._bands.set_verts(
            [self._canvas.corners((max(a, -FAR), low, min(b, FAR), high)) for a, b, *_ in patches]
        )
        self._bands.set_facecolor([theme.floor_colour(patch.mu_static) for patch in patches])
        self._edges.set_segments([[(one.start, low), (one.start, high)] for one in patches[1:]])
        for label in self._labels:
            label.visible = False
        while len(self._labels) < len(patches):
            bottom = self._panel[1] + 8
            label = self._canvas.text(0, bottom, "", theme.LABEL, align="center", clip=self._panel)
            self._labels.append(label)
        for label, patch in zip(self._labels, patches, strict=False):
            label.words = patch.label

    def move(self, left: float, right: float) -> None:
        """Show the stretch of floor between two positions [m]."""
        scale = (self._panel[2] - self._panel[0]) / (right - left)

        def to_page(x: float) -> float:
            return self._panel[0] + (x - left) * scale

        self._move_scale(left, right, to_page)
        for patch, label in zip(self._patches, self._labels, strict=False):
            start, end = to_page(max(patch.start, left)), to_page(min(patch.end, right))
            label.visible = end - start > 8 + 6.2 * len(patch.label)
            label.x = (start + end) / 2
        self._move_glints(left, right)

    def _move_scale(self, left: float, right: float, to_page: Callable[[float], float]) -> None:
        bottom = self._panel[1]
        step = nice_step((right - left) / 8)
        marks = [step * i for i in range(ceil(left / step), floor(right / step) + 1)]
        fine = step / 2
        minor = [fine * i for i in range(ceil(left / fine), floor(right / fine) + 1)]
        ticks = [[(to_page(x), bottom), (to_page(x), bottom - 5)] for x in marks]
        ticks += [[(to_page(x), bottom), (to_page(x), bottom - 3)] for x in minor]
        self._ticks.set_segments(ticks)
        digits = max(0, -floor(np.log10(step) + 1e-9))
        for number in self._numbers:
            number.visible = False
        room = [x for x in marks if self._panel[0] + 14 <= to_page(x) <= self._panel[2] - 14]
        for number, x in zip(self._numbers, room, strict=False):
            number.x = to_page(x)
            number.words = f"{written(x, digits)} m"
            number.visible = True

    def _move_glints(self, left: float, right: float) -> None:
        """Slanting strokes that stay where they are on the ice."""
        pitch, strokes = 0.5 * self._depth, []
        top, bottom = self._surface, self._surface - self._depth
        for patch in self._patches:
            if patch.mu_static is None or patch.mu_static >= theme.SLIPPERY:
                continue
            first, last = max(patch.start, left - pitch), min(patch.end, right + pitch)
            for i in range(ceil(first / pitch), floor((last - self._depth) / pitch) + 1):
                if i % 5 in (0, 1, 3):
                    strokes.append([(i * pitch, bottom), (i * pitch + self._depth, top)])
        self._glints.set_segments(strokes)
