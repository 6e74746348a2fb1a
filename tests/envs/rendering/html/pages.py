"""Pages to look at: a synthetic walk of ten seconds, without an environment."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.envs.rendering.biped import biped_drawing
from stickslip.envs.rendering.html.data import Curve, Event, Line, Page, Panel, Shown
from tests.envs.rendering.frames import SCENE, walk

PERIOD = 0.02
SAMPLES = 501


@cache
def walked(name: str = "walker") -> Shown:
    """Ten seconds at 50 samples a second; the foot slides all the while in the third second."""
    frames = walk(SAMPLES)
    slide = 0.0
    for i, frame in enumerate(frames):
        if 100 <= i < 150:
            slide += 1e-3
        frames[i] = replace(
            frame,
            slide=slide,
            floor_position=frame.floor_position + slide,
            sticking=not 100 <= i < 150,
        )
    slips = np.array([not frame.sticking for frame in frames])
    drawing, ahead = biped_drawing(frames, BipedParams.from_bars(), SCENE, slips)
    time = PERIOD * np.arange(SAMPLES)
    terms = tuple(Line(f"term {i}", np.sin(time + i)) for i in range(4))
    names = ("torque", "power", "crank rate", "friction used", "slid", "return", "score")
    panels = tuple(Panel(one, "-", (Line(one, np.cos(time * 3)),)) for one in names)
    return Shown(
        name=name,
        period=PERIOD,
        panels=(*panels, Panel("reward", "-", terms, limits=(0.0,))),
        events=(Event(100, "slip", "slips"), Event(150, "stick", "sticks", 2.9876)),
        numbers=(("walked [m]", ahead, 2),),
        slips=slips,
        spans=np.array([[2.0, 2.9876]], np.float32),
        timing="Times are made up.",
        drawing=drawing,
        ended="toppled",
        facts=(("return", "1.2"),),
    )


def finer(shown: Shown, times: int) -> Shown:
    """The same at so many times the samples: 10 s in milliseconds and less."""

    def rows(values: np.ndarray) -> np.ndarray:
        return np.repeat(values, times, axis=0)

    drawing = shown.drawing
    assert drawing is not None
    assert shown.slips is not None
    assert drawing.smears is not None
    contacts = tuple(
        replace(one, **{name: rows(value) for name, value in vars(one).items()})
        for one in drawing.contacts
    )
    names = ("points", "bodies", "focus", "smears", "active")
    drawn = {name: rows(value) for name in names if (value := getattr(drawing, name)) is not None}
    return replace(
        shown,
        period=shown.period / times,
        panels=tuple(
            replace(one, lines=tuple(replace(line, values=rows(line.values)) for line in one.lines))
            for one in shown.panels
        ),
        numbers=tuple((name, rows(values), digits) for name, values, digits in shown.numbers),
        slips=rows(shown.slips),
        drawing=replace(drawing, contacts=contacts, **drawn),
        events=tuple(replace(one, sample=one.sample * times) for one in shown.events),
    )


def page(*names: str) -> Page:
    """One of ten seconds for each name."""
    share = Panel("share", "-", (Line("of all", np.array([0.1, 0.4, 0.2])),))
    curve = Curve("friction", np.array([0.01, 0.1, 1.0]), share, log=True)
    episodes = tuple(replace(walked(), name=n) for n in names)
    return Page("A walk", "ten seconds", episodes=episodes, curves=(curve,))
