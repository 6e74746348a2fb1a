"""Pages to look at: a synthetic walk of ten seconds, without an environment."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.envs.rendering.biped import biped_drawing
from stickslip.envs.rendering.page import Episode, Event, Line, Page, Panel
from tests.envs.rendering.frames import SCENE, walk_rows

PERIOD = 0.02
SAMPLES = 501


@cache
def walked(name: str = "walker") -> Episode:
    """Ten seconds at 50 samples a second; the foot slides all the while in the third second."""
    frames, at = walk_rows(SAMPLES), np.arange(SAMPLES)
    slips = (at >= 100) & (at < 150)
    slide = 1e-3 * np.cumsum(slips)
    place = frames.floor_position + slide
    frames = replace(frames, slide=slide, floor_position=place, sticking=~slips)
    drawing = biped_drawing(frames, BipedParams.from_bars(), SCENE, slips)
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
    episodes = tuple(replace(walked(), name=n) for n in names)
    return Page("A walk", "ten seconds", episodes=episodes)
