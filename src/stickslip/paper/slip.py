"""Figs. 16 to 19: how the supporting foot slides at a constant crank rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams
from stickslip.envs.rendering import theme
from stickslip.paper import drawing, slip_claims
from stickslip.paper.figure import NOT_STATED, Claim, Columns, Result, by_construction
from stickslip.paper.slip_claims import SECOND
from stickslip.paper.torque import peak_of, phases, poses, steady
from stickslip.paper.walks import PERIODS, SAME_INSTANT, Walk, walk

SLOW, CHART_FRICTION = 3.0, 0.05
FRICTIONS = (0.03, 0.04, 0.05, 0.06, 0.07, 0.075, 0.079, 0.08, 0.1)
RATES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)
RATE_FRICTION = 0.1
FAST, STATIC, KINETIC = 5.0, 0.2, (0.2, 0.1, 0.05)
STEPS = 2
"""Steps of the timeline of Fig. 16."""
RESTS, FORWARDS, BACKWARDS = "static friction", "sliding forwards", "sliding backwards"
COLOURS = {RESTS: theme.SWING["main"], FORWARDS: theme.MOTOR, BACKWARDS: theme.SLIDES}

State = tuple[str, float, float]
"""A state of the flow chart, its start and end in steps, t / T."""


def states(samples: int) -> Result:
    """Fig. 16."""
    one = walk(BipedParams.from_bars(), SLOW, CHART_FRICTION, samples=samples)
    states = timeline(one)
    titles = ("state", "start / T [-]", "end / T [-]")
    columns: Columns = dict(zip(titles, zip(*states, strict=True), strict=True))
    return Result({"": columns}, lambda: _draw_states(states, one), [flow(states)])


def timeline(one: Walk) -> list[State]:
    """The states of the first STEPS steps, in order, without gaps."""
    found, at = [], 0.0
    for slide in one.slides:
        if slide.start >= STEPS - SAME_INSTANT:
            break
        if slide.start > at + SAME_INSTANT:
            found.append((RESTS, at, slide.start))
        at = min(slide.end, float(STEPS))
        found.append((FORWARDS if slide.displacement > 0 else BACKWARDS, slide.start, at))
    if at < STEPS:
        found.append((RESTS, at, float(STEPS)))
    return found


def flow(located: list[State]) -> Claim:
    """Fig. 16 has every state of the flow chart."""
    shown = ", ".join(
        f"{state} to {end:.3f}" for state, start, end in located if start < 1 - SAME_INSTANT
    )
    return Claim(
        "static friction, imminent sliding, sliding and back (flow chart)",
        f"first step at {SLOW:g} rad/s, μ = {CHART_FRICTION:g}, in T: {shown}",
        by_construction({state for state, _, _ in located} == set(COLOURS)),
        "the walk switches by the chart's rules, eqs. (32), (33) and (36); imminent sliding lasts "
        "no time",
    )


def frictions(samples: int) -> Result:
    """Fig. 17."""
    params = BipedParams.from_bars()
    walks = {mu: walk(params, SLOW, mu, samples=samples) for mu in FRICTIONS}
    use = friction_use(params, SLOW, samples)
    claims = [
        slip_claims.least_friction(walks, use, SLOW),
        slip_claims.onset(walks),
        slip_claims.end(walks, swing_heights(params, samples)),
        slip_claims.second(walks),
        slip_claims.repeatedly(walks),
    ]
    return _result("mu", "-", walks, f"constant crank rate {SLOW:g} rad/s", claims)


def speeds(samples: int) -> Result:
    """Fig. 18."""
    params = BipedParams.from_bars()
    walks = {rate: walk(params, rate, RATE_FRICTION, samples=samples) for rate in RATES}
    shown = ", ".join(f"{1e3 * one.distance(SECOND):.2f} mm at {w:g}" for w, one in walks.items())
    faster = Claim(
        "(read as: faster slides farther)",
        f"slips from {least_rate(params, RATE_FRICTION, samples):.3f} rad/s up; distance slid in "
        f"the second step {shown} rad/s",
        NOT_STATED,
        "the chapter prints curves only; least speed with |f| / N = 0.1 at some phase",
    )
    return _result("crank rate", "rad/s", walks, f"friction {RATE_FRICTION:g}", [faster])


def kinetic(samples: int) -> Result:
    """Fig. 19."""
    params = BipedParams.from_bars()
    walks = {mu: walk(params, FAST, STATIC, mu, samples=samples) for mu in KINETIC}
    claims = [
        slip_claims.first_onset(walks),
        slip_claims.later_onsets(walks),
        slip_claims.smaller_slide(walks),
    ]
    note = f"constant crank rate {FAST:g} rad/s, μs = {STATIC:g}"
    return _result("mu_kinetic", "-", walks, note, claims)


def friction_use(params: BipedParams, crank_rate: float, samples: int) -> np.ndarray:
    """|f| / N over a step without slip [samples + 1]: the friction that rest needs."""
    needs = steady(params, phases(samples), crank_rate)
    return np.abs(np.asarray(needs.friction_force / needs.normal_force))


def least_rate(params: BipedParams, mu: float, samples: int) -> float:
    """The crank rate above which the foot slips [rad/s], by bisection of the largest |f| / N."""
    low, high = 0.1, 8.0
    for _ in range(30):
        middle = (low + high) / 2
        slips = peak_of(friction_use(params, middle, samples))[1] > mu
        low, high = (low, middle) if slips else (middle, high)
    return low


def swing_heights(params: BipedParams, samples: int) -> dict[str, float]:
    """Phases [-] at which the swinging leg's ankle, knee and centre of mass are highest."""
    pose = poses(params, phases(samples))
    swing = [place for place, name in enumerate(BODIES) if name.endswith("p")]
    mass = np.asarray(params.mass)[[int(BODIES[place].rstrip("p")) - 1 for place in swing]]
    heights = {
        "ankle": np.asarray(pose.pins.E)[:, 1, 1],
        "knee": np.asarray(pose.pins.K)[:, 1, 1],
        "centre of mass": np.asarray(pose.centres)[:, swing, 1] @ mass,
    }
    return {name: peak_of(height)[0] for name, height in heights.items()}


def _result(
    name: str, unit: str, walks: Mapping[float, Walk], note: str, claims: list[Claim]
) -> Result:
    """Places and slides of walks by the number that varies."""
    rows = [(value, slide) for value, one in walks.items() for slide in one.slides]
    places = {f"place of the foot, {name} = {x:g} [m]": one.place for x, one in walks.items()}
    slides = {
        f"{name} [{unit}]": [value for value, _ in rows],
        "start / T [-]": [slide.start for _, slide in rows],
        "end / T [-]": [slide.end for _, slide in rows],
        "displacement [m]": [slide.displacement for _, slide in rows],
    }
    time = next(iter(walks.values())).time
    tables = {"": {"time / T [-]": time, **places}, "-slides": slides}
    named = {f"{name} = {x:g}": one for x, one in walks.items()}
    return Result(tables, lambda: _draw(named, note), claims)


def _draw(walks: Mapping[str, Walk], note: str):
    """Places over time, and when the foot slides in the second step."""
    ratio = 0.07 * (3 + len(walks))
    figure, axes = drawing.sheet(2, height=2.2 + 0.9 * ratio, height_ratios=(1.4, ratio))
    place, bars = axes[:, 0]
    time = next(iter(walks.values())).time
    drawing.family(place, time, [(name, 1e3 * one.place) for name, one in walks.items()])
    title = "place of the foot x1 [mm], forwards up"
    drawing.name_panel(place, title, note, "time in steps, t / T")
    place.set_xlim(0, PERIODS)
    rows = zip(walks.values(), drawing.shades(len(walks)), strict=True)
    for row, (one, colour) in enumerate(rows):
        for part in one.within(SECOND):
            look = {"height": 0.75, "color": colour, "edgecolor": theme.PANEL}
            bars.barh(row, part.end - part.start, left=part.start - SECOND, **look)
    bars.set_yticks(range(len(walks)), list(walks), fontsize=7)
    bars.set_ylim(len(walks) - 0.5, -0.5)
    bars.set_xlim(0, 1)
    drawing.name_panel(bars, "when it slides in a step", "the second step", "share of the step")
    return figure


def _draw_states(states: list[State], one: Walk):
    """The foot's place over time, shaded by its state."""
    figure, axes = drawing.sheet(height=3.2)
    axis = axes[0, 0]
    chosen = one.time <= STEPS
    axis.plot(one.time[chosen], 1e3 * one.place[chosen], color=theme.INK, lw=1.4)
    spans = {
        state: axis.axvspan(start, end, color=COLOURS[state], alpha=0.35, lw=0)
        for state, start, end in states
    }
    drawing.legend(axis, handles=list(spans.values()), labels=list(spans))
    note = f"{SLOW:g} rad/s, μ = {CHART_FRICTION:g}"
    drawing.name_panel(axis, "place of the foot x1 [mm]", note, "time in steps, t / T")
    axis.set_xlim(0, STEPS)
    return figure
