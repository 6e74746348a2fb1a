"""Pictures of PASIBOT walking."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.biped.contact import Contact
from stickslip.envs.rendering.biped.floor import Floor
from stickslip.envs.rendering.biped.header import Header, draw_key
from stickslip.envs.rendering.biped.linkage import SOLE, Linkage, Mechanism, plain
from stickslip.envs.rendering.biped.strips import History, Strips
from stickslip.envs.rendering.biped.trace import SlipTrace
from stickslip.envs.rendering.page import make_page

if TYPE_CHECKING:
    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.scene import Scene
    from stickslip.envs.rendering.biped.frame import BipedFrame

FLOOR_BAND = 46.0
HEADROOM = 0.08
"""Free height over the linkage's highest point, in robot heights."""


class BipedRenderer:
    """Draws frames of one robot in one scene, without a display.

    params, scene: one robot and one scene, not batches; a frame may bring its episode's own floor
    and weight. width, height: of the picture [px].
    torque_limit: the torque strip always shows plus and minus this [N m].

    The camera keeps the hip in place and the floor passes below it, so a picture depends on its
    frame alone, but for the strips and the marks of slides, which remember the frames since
    `reset`. Needs the extra `viz`.
    """

    def __init__(
        self,
        params: BipedParams,
        scene: Scene,
        *,
        width: int = 960,
        height: int = 540,
        torque_limit: float = 4.0,
    ):
        page = make_page(width, height)
        if not torque_limit > 0:
            raise ValueError(f"torque_limit = {torque_limit}; accepted: > 0 N m")
        self._canvas, self._panel = page.canvas, page.panel
        self._mechanism = Mechanism(params)
        self._surface = -SOLE * self._mechanism.crank
        tall = (self._mechanism.top - self._surface) * (1 + HEADROOM)
        self._scale = (page.panel[3] - page.panel[1] - FLOOR_BAND) / tall
        self._add_world(params, scene)
        self._header = Header(page.canvas, page.header)
        self._strips = Strips(page.canvas, page.strips, torque_limit)
        self._history = History()
        self._last: BipedFrame | None = None

    def reset(self) -> None:
        """Forget the history: empty strips and a floor without marks."""
        self._history.forget()
        self._trace.forget()
        self._last = None

    def draw(self, frame: BipedFrame) -> np.ndarray:
        """The picture of a frame: uint8 [height, width, 3], a fresh array."""
        frame = frame.finite(self._last)
        if not self._history.is_before(frame.time):
            self.reset()
        self._last = frame
        self._history.record(frame)
        self._trace.record(frame)
        pose = self._mechanism.pose(frame.phase % (2 * pi))
        hip = frame.floor_position + float(pose.pins["A"][0, 0])
        left, right = self._move_camera(hip)
        self._floor.lay(frame.floor)
        self._contact.weigh(frame.weight)
        self._floor.move(left, right)
        self._trace.move(left, right)
        self._linkage.move(pose, frame.floor_position)
        self._contact.move(frame, self._surface, self._scale)
        way = hip - self._mechanism.start
        self._header.move(frame, way if frame.walked is None else frame.walked)
        self._strips.move(self._history, frame)
        return self._canvas.picture()

    def _add_world(self, params: BipedParams, scene: Scene) -> None:
        """The panel with floor, marks, contact and linkage, in this order."""
        canvas, panel, surface = self._canvas, self._panel, self._surface
        draw_key(canvas, panel[0] + 12, panel[3] - 18)
        self._view = canvas.view()
        self._floor = Floor(canvas, self._view, panel, scene, surface, FLOOR_BAND / self._scale)
        self._trace = SlipTrace(canvas, self._view, panel, surface, FLOOR_BAND)
        mass = plain(params.total_mass) + (0.0 if scene.payload is None else plain(scene.payload))
        height = self._mechanism.top - surface
        self._contact = Contact(
            canvas, self._view, panel, weight=mass * plain(params.gravity), height=height
        )
        self._linkage = Linkage(canvas, self._view, panel, self._mechanism)
        self._contact.add_arrow()

    def _move_camera(self, hip: float) -> tuple[float, float]:
        """Keep the hip's A a little left of the middle; the shown stretch of floor [m]."""
        left, bottom, right, _ = self._panel
        span = (right - left) / self._scale
        start = hip - 0.46 * span
        up = bottom + FLOOR_BAND - self._scale * self._surface
        across = left - self._scale * start
        self._view.set_matrix(np.array([[self._scale, 0, across], [0, self._scale, up], [0, 0, 1]]))
        return start, start + span
