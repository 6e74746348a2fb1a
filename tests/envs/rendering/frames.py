"""A synthetic walk to draw, shared by the tests of pictures and of animations."""

from __future__ import annotations

import math
from dataclasses import replace

from stickslip.dynamics.scene import Scene
from stickslip.envs.rendering import BipedFrame

STANDING = BipedFrame(
    phase=2.2,
    steps=0,
    floor_position=0.0,
    slide=0.0,
    crank_rate=3.0,
    foot_velocity=0.0,
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
    """A synthetic walk at 3 rad/s and 20 pictures a second; the foot slides when asked to."""
    frames, phase, steps, position, slide = [], math.pi / 2, 0, 0.0, 0.0
    for i in range(count):
        phase += 0.15
        if phase >= 1.5 * math.pi:
            phase, steps, position = phase - math.pi, steps + 1, position + 0.24
        slide, position = slide + slide_per_frame, position + slide_per_frame
        frames.append(
            replace(
                STANDING,
                phase=phase,
                steps=steps,
                floor_position=position,
                slide=slide,
                time=0.05 * i,
                torque=math.sin(2 * phase),
                sticking=not slide_per_frame,
            )
        )
    return frames
