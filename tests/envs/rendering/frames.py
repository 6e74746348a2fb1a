"""A synthetic walk to draw, shared by the tests of pictures and of animations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stickslip.dynamics.scene import Scene
from stickslip.envs.rendering.biped import BipedFrame

STANDING = BipedFrame(
    phase=2.2,
    steps=0,
    floor_position=0.0,
    slide=0.0,
    crank_rate=3.0,
    time=0.0,
    torque=0.8,
    friction_force=5.0,
    normal_force=83.0,
    zmp=0.05,
    mu_static=0.4,
    mu_kinetic=0.3,
    sticking=True,
    mean_crank_rate=3.0,
    commanded_rate=3.0,
)
SCENE = Scene.uniform(0.4, 0.3)


def walk(count: int, slide_per_frame: float = 0.0) -> list[BipedFrame]:
    """The frames of `walk_rows`, one by one."""
    rows = walk_rows(count, slide_per_frame)
    names = ("phase", "steps", "floor_position", "slide", "time", "torque")
    return [replace(rows, **{name: getattr(rows, name)[i] for name in names}) for i in range(count)]


def walk_rows(count: int, slide_per_frame: float = 0.0) -> BipedFrame:
    """A synthetic walk at 3 rad/s and 20 pictures a second; the foot slides when asked to."""
    turned, slide = 0.15 * np.arange(1, count + 1), slide_per_frame * np.arange(1, count + 1)
    steps = (turned // np.pi).astype(int)
    return replace(
        STANDING,
        phase=np.pi / 2 + turned % np.pi,
        steps=steps,
        floor_position=0.24 * steps + slide,
        slide=slide,
        time=0.05 * np.arange(count),
        torque=np.sin(2 * turned),
        sticking=not slide_per_frame,
    )
