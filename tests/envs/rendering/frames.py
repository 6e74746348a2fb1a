"""A synthetic walk to draw, and pages of it, without an environment."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.scene import Scene
from stickslip.envs.biped.picture import BipedFrame, biped_drawing, stretches_of
from stickslip.envs.rendering.linkage import Mechanism
from stickslip.envs.rendering.page import Episode, Event, Line, Page, Panel

SCENE = Scene.uniform(0.4, 0.3)
STANDING = BipedFrame(
    phase=2.2,
    floor=stretches_of(SCENE.floor),
    weight=83.0,
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
)


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
        slips=slide_per_frame > 0,
    )


PERIOD = 0.02
SAMPLES = 501


@cache
def walked(name: str = "walker") -> Episode:
    """Ten seconds at 50 samples a second; the foot slides all the while in the third second."""
    frames, at = walk_rows(SAMPLES), np.arange(SAMPLES)
    slips = (at >= 100) & (at < 150)
    slide = 1e-3 * np.cumsum(slips)
    place = frames.floor_position + slide
    frames = replace(frames, slide=slide, floor_position=place, slips=slips)
    drawing = biped_drawing(frames, Mechanism(BipedParams.from_bars()))
    ahead = drawing.focus[:, 0]
    time = PERIOD * np.arange(SAMPLES)
    terms = tuple(Line(f"term {i}", np.sin(time + i)) for i in range(4))
    names = ("torque", "power", "crank rate", "friction used", "slid", "return", "score")
    panels = tuple(Panel(one, "-", (Line(one, np.cos(time * 3)),)) for one in names)
    return Episode(
        name=name,
        period=PERIOD,
        panels=(*panels, Panel("reward", "-", terms, limits=(0.0,))),
        events=(Event(100, "slip", "slips"), Event(150, "stick", "sticks")),
        numbers=(("walked [m]", ahead, 2),),
        slips=slips,
        drawing=drawing,
        ended="toppled",
        facts=(("return", "1.2"),),
    )


def page(*names: str) -> Page:
    """One of ten seconds for each name."""
    return Page("A walk", "ten seconds", episodes=tuple(replace(walked(), name=n) for n in names))
