"""Fig. 16: the states that the flow chart goes through, as a timeline of one walk."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from stickslip.dynamics.biped import BipedParams, Euler, Paper
from stickslip.envs.rendering import theme
from stickslip.paper import drawing
from stickslip.paper.result import NOT_STATED, Claim, Columns, Result, Setting, by_construction
from stickslip.paper.walks import SAME_INSTANT, Slide, Walk, walk

RATE, FRICTION = 3.0, 0.05
EULER, DIFFERENCES = Euler(record_events=True), Paper(step=1e-4)
"""The chapter's scheme. It prints neither its time step nor its D, only that D is fine enough."""
STEPS = 2
"""Steps of the timeline."""
RESTS, FORWARDS, BACKWARDS = "static friction", "sliding forwards", "sliding backwards"
COLOURS = {RESTS: theme.SWING["main"], FORWARDS: theme.MOTOR, BACKWARDS: theme.SLIDES}


class Spell(NamedTuple):
    """A stretch of time in one state; start and end in steps, t / T."""

    state: str
    start: float
    end: float


def states(setting: Setting) -> Result:
    """Fig. 16."""
    params = BipedParams.from_bars()
    setting.say("the exact walk")
    exact = walk(params, RATE, FRICTION, samples=setting.samples)
    setting.say("the chapter's Euler steps")
    steps = walk(
        params,
        RATE,
        FRICTION,
        samples=setting.samples,
        integrator=EULER,
        fidelity=DIFFERENCES,
    )
    timelines = {"instants located": spells(exact), f"Euler, T / {setting.samples}": spells(steps)}
    located, stepped = timelines.values()
    claims = [_flow(located), _euler(located, stepped, setting.samples)]
    return Result(
        {"": _columns(located), "-euler": _columns(stepped)},
        lambda: _draw(timelines, exact),
        claims,
    )


def _flow(located: list[Spell]) -> Claim:
    shown = ", ".join(
        f"{spell.state} to {spell.end:.3f}" for spell in located if spell.start < 1 - SAME_INSTANT
    )
    return Claim(
        "static friction, imminent sliding, sliding and back (flow chart)",
        f"first step at {RATE:g} rad/s, μ = {FRICTION:g}, in T: {shown}",
        by_construction({spell.state for spell in located} == set(COLOURS)),
        "the walk switches by the chart's own rules, eqs. (32), (33) and (36); the example is one "
        "that goes through all of its states. Imminent sliding lasts no time: it is the choice of "
        "the friction's direction at the instant when |f| passes μs N",
    )


def _euler(located: list[Spell], stepped: list[Spell], samples: int) -> Claim:
    same = [spell.state for spell in located] == [spell.state for spell in stepped]
    lag = _lag(located, stepped) * samples
    return Claim(
        "(the chart's time steps against located instants)",
        f"{'the same' if same else 'not the same'} sequence of states with Euler steps of "
        f"T / {samples}" + (f", each change within {lag:.1f} time steps" if same else ""),
        NOT_STATED,
        "the chart tests eq. (32) once a time step, so sliding starts up to a step late, and "
        "takes the accelerations at the step's start for the whole step, which moves the end",
    )


def spells(course: Walk) -> list[Spell]:
    """The states of the first STEPS steps, in order, without gaps."""
    found, at = [], 0.0
    for slide in course.slides:
        if slide.start >= STEPS - SAME_INSTANT:
            break
        if slide.start > at + SAME_INSTANT:
            found.append(Spell(RESTS, at, slide.start))
        at = min(slide.end, float(STEPS))
        found.append(Spell(_direction(slide), slide.start, at))
    if at < STEPS:
        found.append(Spell(RESTS, at, float(STEPS)))
    return found


def _direction(slide: Slide) -> str:
    return FORWARDS if slide.displacement > 0 else BACKWARDS


def _lag(first: list[Spell], second: list[Spell]) -> float:
    """The largest distance between ends of the same spells [T]."""
    ends = zip(first, second, strict=False)
    return max(abs(a.end - b.end) for a, b in ends)


def _columns(timeline: list[Spell]) -> Columns:
    return {
        "state": [spell.state for spell in timeline],
        "start / T [-]": [spell.start for spell in timeline],
        "end / T [-]": [spell.end for spell in timeline],
    }


def _draw(timelines: Mapping[str, list[Spell]], course: Walk):
    figure, axes = drawing.sheet(2, height=2.2, sharex=True)
    bars, place = axes[:, 0]
    for row, timeline in enumerate(timelines.values()):
        for spell in timeline:
            bars.barh(
                row,
                spell.end - spell.start,
                left=spell.start,
                height=0.6,
                color=COLOURS[spell.state],
                label=spell.state,
            )
    handles, labels = bars.get_legend_handles_labels()
    chosen = dict(zip(labels, handles, strict=True))
    drawing.legend(bars, handles=list(chosen.values()), labels=list(chosen))
    bars.set_yticks(range(len(timelines)), list(timelines))
    bars.invert_yaxis()
    bars.grid(axis="y", visible=False)
    drawing.name_panel(bars, "state of the foot", f"{RATE:g} rad/s, μ = {FRICTION:g}")
    place.plot(course.share, 1e3 * np.asarray(course.place), color=theme.INK, lw=1.4)
    drawing.name_panel(
        place, "place of the foot x1 [mm]", "dashed: it breaks loose", "time in steps, t / T"
    )
    for one in course.slides:
        if one.start < STEPS - SAME_INSTANT:
            drawing.mark(place, x=one.start)
    shown = 1e3 * np.asarray(course.place)[course.share <= STEPS]
    place.set_ylim(shown.min() - 0.5, shown.max() + 0.5)
    place.set_xlim(0, STEPS)
    return figure
