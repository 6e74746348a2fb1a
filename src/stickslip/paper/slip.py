"""Figs. 17, 18 and 19: how the supporting foot slides at a constant crank rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams
from stickslip.envs.rendering import theme
from stickslip.paper import drawing
from stickslip.paper.result import (
    AGREES,
    BY_CALIBRATION,
    DIFFERS,
    NOT_STATED,
    Claim,
    Columns,
    Result,
    Setting,
    verdict_of,
)
from stickslip.paper.torque import peak_of, phases, poses, steady
from stickslip.paper.walks import PERIODS, Slide, Walk, walk

SLOW = 3.0
FRICTIONS = (0.03, 0.04, 0.05, 0.06, 0.07, 0.075, 0.079, 0.08, 0.1)
STATED_FRICTION = 0.08
RATES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)
RATE_FRICTION = 0.1
FAST, STATIC, KINETIC = 5.0, 0.2, (0.2, 0.1, 0.05)
MID_STEP = (0.4, 0.6)
"""What counts as "at mid-step", as shares of the step [-]."""
QUARTER = 0.25


def frictions(setting: Setting) -> Result:
    """Fig. 17."""
    params = BipedParams.from_bars()
    walks = {}
    for mu in FRICTIONS:
        setting.say(f"friction {mu:g}")
        walks[mu] = walk(params, SLOW, mu, samples=setting.samples)
    use = friction_use(params, SLOW, setting.samples)
    claims = [
        _least_friction(walks, use),
        _onset(walks, peak_of(use)[0]),
        _end(walks, swing_heights(params, setting.samples)),
        _second(walks, use),
        _repeatedly(walks),
    ]
    curves = {f"μ = {mu:g}": one for mu, one in walks.items()}
    tables = {"": _positions(curves), "-slides": _slides({"mu [-]": walks})}
    return Result(tables, lambda: _draw(curves, f"constant crank rate {SLOW:g} rad/s"), claims)


def speeds(setting: Setting) -> Result:
    """Fig. 18."""
    params = BipedParams.from_bars()
    walks = {}
    for rate in RATES:
        setting.say(f"{rate:g} rad/s")
        walks[rate] = walk(params, rate, RATE_FRICTION, samples=setting.samples)
    least = least_rate(params, RATE_FRICTION, setting.samples)
    slips = [w for w, one in walks.items() if one.slides]
    first = ", ".join(
        f"{1e3 * one.path(1):.2f} mm in {len(one.within(1))} at {w:g}" for w, one in walks.items()
    )
    claims = [
        Claim(
            "μ = 0.1, several crank speeds: curves only",
            f"slips from {least:.3f} rad/s up (drawn: {', '.join(f'{w:g}' for w in slips)})",
            NOT_STATED,
            "least speed with |f| / N = 0.1 at some phase; both f = P' w² and the part of N that "
            "moves, Y' w², grow with the square of the speed",
        ),
        Claim(
            "(read as: faster slides farther)",
            f"way slid in the second step and number of slides: {first} rad/s",
            NOT_STATED,
            "the impulse that rest would need in a step grows with the crank rate, and what "
            "friction can give in it shrinks with the step's time",
        ),
    ]
    curves = {f"{w:g} rad/s": one for w, one in walks.items()}
    tables = {"": _positions(curves), "-slides": _slides({"crank rate [rad/s]": walks})}
    return Result(tables, lambda: _draw(curves, f"friction {RATE_FRICTION:g}"), claims)


def kinetic(setting: Setting) -> Result:
    """Fig. 19."""
    params = BipedParams.from_bars()
    walks = {}
    for mu in KINETIC:
        setting.say(f"kinetic friction {mu:g}")
        walks[mu] = walk(params, FAST, STATIC, mu, samples=setting.samples)
    first = [one.slides[0].start for one in walks.values()]
    onsets = {mu: [f"{s.onset:.3f}" for s in one.within(1)] for mu, one in walks.items()}
    later = [[s.onset for s in one.within(1)] for one in walks.values()]
    same = len({len(one) for one in later}) == 1 and np.ptp(later, axis=0).max() < 5e-3
    paths = [one.path(1) for one in walks.values()]
    ends = [abs(one.slide[-1]) for one in walks.values()]
    shown = "; ".join(f"{', '.join(values)} for {mu:g}" for mu, values in onsets.items())
    claims = [
        Claim(
            "slips at the same point for μk = 0.2, 0.1 and 0.05",
            f"first onset at {min(first):.4f} T, apart by {np.ptp(first):.1g} T; onsets in the "
            f"second step: {shown}",
            verdict_of(np.ptp(first) < 1e-6 and same, np.ptp(first) < 1e-6),
            "until it first slips, μk does not enter. A later onset is the same only if the foot "
            "has come to rest before |f| / N passes μs again: low μk makes one slide run into the "
            "next",
        ),
        Claim(
            "the bigger μk, the smaller the slide",
            "way slid in the second step "
            + ", ".join(f"{1e3 * p:.2f} mm for {mu:g}" for mu, p in zip(walks, paths, strict=True))
            + f"; displacement after {PERIODS} steps "
            + ", ".join(f"{1e3 * e:.2f}" for e in ends)
            + " mm",
            verdict_of(
                bool(np.all(np.diff(paths) > 0) and np.all(np.diff(ends) > 0)),
                bool(np.all(np.diff(paths) > 0)),
            ),
            "friction takes the foot's speed away; the displacement can shrink all the same, "
            "where slides go both ways",
        ),
    ]
    curves = {f"μk = {mu:g}": one for mu, one in walks.items()}
    tables = {"": _positions(curves), "-slides": _slides({"mu_kinetic [-]": walks})}
    note = f"constant crank rate {FAST:g} rad/s, μs = {STATIC:g}"
    return Result(tables, lambda: _draw(curves, note), claims)


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
    """Where in the step [-] the swinging leg's ankle, knee and centre of mass are highest."""
    pose = poses(params, phases(samples))
    swing = [place for place, name in enumerate(BODIES) if name.endswith("p")]
    mass = np.asarray(params.mass)[[int(BODIES[place].rstrip("p")) - 1 for place in swing]]
    heights = {
        "ankle": np.asarray(pose.pins.E)[:, 1, 1],
        "knee": np.asarray(pose.pins.K)[:, 1, 1],
        "centre of mass": np.asarray(pose.centres)[:, swing, 1] @ mass,
    }
    return {name: peak_of(height)[0] for name, height in heights.items()}


def _least_friction(walks: Mapping[float, Walk], use: np.ndarray) -> Claim:
    place, least = peak_of(use)
    slips = [mu for mu, one in walks.items() if one.slides]
    stays = [mu for mu, one in walks.items() if not one.slides]
    close = round(least, 2) == STATED_FRICTION
    return Claim(
        f"{STATED_FRICTION:g} is the least friction that prevents slip at {SLOW:g} rad/s",
        f"{least:.5f} = largest |f| / N, at {place:.3f} T; the walks slip up to "
        f"{max(slips):g} and do not from {min(stays):g} on",
        BY_CALIBRATION if close else DIFFERS,
        "the hip's mass and the bars' density were chosen for this number",
    )


def _main(one: Walk) -> list[Slide]:
    """The slides of the second step but those that start in its first quarter."""
    return [slide for slide in one.within(1) if slide.onset > QUARTER]


def _onset(walks: Mapping[float, Walk], peak: float) -> Claim:
    onsets = {mu: [s.onset for s in _main(one)] for mu, one in walks.items() if one.slides}
    every = [onset for found in onsets.values() for onset in found]
    shown = "; ".join(
        f"{', '.join(f'{o:.3f}' for o in found)} ({mu:g})" for mu, found in onsets.items()
    )
    return Claim(
        "sliding starts at mid-step",
        f"onsets after the first quarter, in T (at μ): {shown}",
        verdict_of(all(MID_STEP[0] < onset < MID_STEP[1] for onset in every)),
        f"the peak of |f| / N is at {peak:.3f} T: less friction, earlier onset, except where the "
        "foot is still sliding from before; counted as mid-step: "
        f"{MID_STEP[0]:g} to {MID_STEP[1]:g} T",
    )


def _end(walks: Mapping[float, Walk], high: Mapping[str, float]) -> Claim:
    ends = {mu: _main(one)[-1].stop for mu, one in walks.items() if _main(one)}
    lasting = "; ".join(f"{end:.3f} ({mu:g})" for mu, end in ends.items())
    near = [abs(end - place) < 0.05 for end in ends.values() for place in high.values()]
    return Claim(
        "and lasts until the swinging leg is highest",
        f"slides end at {lasting} T; highest are the swinging leg's ankle at {high['ankle']:.3f}, "
        f"its centre of mass at {high['centre of mass']:.3f}, its knee at {high['knee']:.3f} T",
        AGREES if all(near) else verdict_of(False, any(near)),
        "a slide ends when friction has used up the momentum, later the lower μ is; no one height "
        "fixes it. The ankle is highest at mid-step itself, where the slide starts",
    )


def _second(walks: Mapping[float, Walk], use: np.ndarray) -> Claim:
    early = {mu: [s for s in one.within(1) if s.onset <= QUARTER] for mu, one in walks.items()}
    two = {mu: found[0] for mu, found in early.items() if found and _main(walks[mu])}
    shown = "; ".join(f"{s.onset:.3f} to {s.stop:.3f} ({mu:g})" for mu, s in two.items())
    inside = [s.stop <= QUARTER for mu, s in two.items() if mu > min(walks)]
    return Claim(
        "if there are two slides, the other one is in the first quarter",
        f"second slides, in T (at μ): {shown}",
        verdict_of(inside and all(inside), any(inside)),
        f"|f| / N jumps from {use[-1]:.3f} to {use[0]:.3f} at the exchange of support, as the legs "
        "change roles: the foot breaks loose the moment it takes the weight",
    )


def _repeatedly(walks: Mapping[float, Walk]) -> Claim:
    mu = min(walks)
    found = walks[mu].within(1)
    sliding = sum(s.stop - s.onset for s in found)
    shown = ", ".join(
        f"{s.onset:.3f} to {s.stop:.3f} T {'forwards' if s.advance > 0 else 'backwards'}"
        for s in found
    )
    return Claim(
        f"for μ = {mu:g} slip occurs repeatedly at various phases",
        f"{len(found)} slides a step, {100 * sliding:.0f} % of its time: {shown}",
        verdict_of(len(found) > 2, sliding > 0.5),
        "one slide turns into the next without rest, the second lasts almost until the exchange",
    )


def _positions(walks: Mapping[str, Walk]) -> Columns:
    every = list(walks.values())
    slides = {f"slide, {name} [m]": one.slide for name, one in walks.items()}
    return {"time / T [-]": every[0].share, **slides}


def _slides(family: Mapping[str, Mapping[float, Walk]]) -> Columns:
    ((name, walks),) = family.items()
    rows = [(value, slide) for value, one in walks.items() for slide in one.slides]
    return {
        name: [value for value, _ in rows],
        "start / T [-]": [slide.start for _, slide in rows],
        "end / T [-]": [slide.end for _, slide in rows],
        "onset in its step [-]": [slide.onset for _, slide in rows],
        "advance [m]": [slide.advance for _, slide in rows],
    }


def _draw(walks: Mapping[str, Walk], note: str):
    ratio = 0.07 * (3 + len(walks))
    figure, axes = drawing.sheet(2, height=2.2 + 0.9 * ratio, height_ratios=(1.4, ratio))
    course, bars = axes[:, 0]
    for (name, one), colour in zip(walks.items(), drawing.shades(len(walks)), strict=True):
        course.plot(one.share, 1e3 * one.slide, color=colour, lw=1.4, label=name)
    drawing.legend(course)
    drawing.name_panel(course, "slide of the foot x1 [mm]", note, "time in steps, t / T")
    course.set_xlim(0, PERIODS)
    for row, (one, colour) in enumerate(
        zip(walks.values(), drawing.shades(len(walks)), strict=True)
    ):
        for slide in one.slides:
            start, end = max(slide.start - 1, 0.0), min(slide.end - 1, 1.0)
            if end > start:
                look = {"height": 0.75, "color": colour, "edgecolor": theme.PANEL}
                bars.barh(row, end - start, left=start, **look)
    bars.set_yticks(range(len(walks)), list(walks), fontsize=7)
    bars.invert_yaxis()
    bars.set_xlim(0, 1)
    drawing.name_panel(bars, "when it slides in a step", "the second step", "share of the step")
    return figure
