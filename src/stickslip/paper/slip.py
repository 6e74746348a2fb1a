"""Figs. 16 to 19: how the supporting foot slides at a constant crank rate.

Claims are about the second step: the first begins with the foot at rest.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams
from stickslip.optim.gait.footing import peak_of
from stickslip.optim.progress import say_stage
from stickslip.paper.result import (
    Claim,
    Result,
    claim,
    curves,
    each,
)
from stickslip.paper.slides import PERIODS, SAME_INSTANT, Slide, Walk, walk
from stickslip.paper.steady import TIME, alike_rates, friction_use, phases, poses, steady

SLOW, CHART_FRICTION = 3.0, 0.05
FRICTIONS = (0.03, 0.04, 0.05, 0.06, 0.07, 0.075, 0.079, 0.08, 0.1)
RATES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)
RATE_FRICTION = 0.1
FAST, STATIC, KINETIC = 5.0, 0.2, (0.2, 0.1, 0.05)
STEPS = 2
"""Steps of the timeline of Fig. 16."""
RESTS, FORWARDS, BACKWARDS = "static friction", "sliding forwards", "sliding backwards"
NEAR = 0.05
"""A slide ends "when the leg is highest" if it does so within this time [T]."""
SECOND = 1
"""The second step, counted from 0."""

Walks = Mapping[float, Walk]
"""Walks by the number that varies."""

State = tuple[str, float, float]
"""A state of the flow chart, its start and end in steps, t / T."""


def states(params: BipedParams, samples: int) -> Result:
    """Fig. 16."""
    (rate,) = alike_rates(params, SLOW)
    one = walk(params, rate, CHART_FRICTION, samples=samples)
    states = timeline(one)
    shown = one.time <= STEPS
    time, place = one.time[shown], 1e3 * one.place[shown]
    named = {name: np.full(len(time), np.nan) for name in (RESTS, FORWARDS, BACKWARDS)}
    for name, start, end in states:
        inside = (time >= start - SAME_INSTANT) & (time <= end + SAME_INSTANT)
        named[name][inside] = place[inside]
    return Result(TIME, time, [curves("foot position", "mm", named)], [flow(states, rate)])


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


def flow(located: list[State], rate: float) -> Claim:
    """Fig. 16 has every state of the flow chart."""
    shown = ", ".join(
        f"{state} to {end:.3f}" for state, start, end in located if start < 1 - SAME_INSTANT
    )
    measured = f"first step at {rate:g} rad/s, μ = {CHART_FRICTION:g}, in T: {shown}"
    return claim("fig16", "flow", measured)


def frictions(params: BipedParams, samples: int) -> Result:
    """Fig. 17."""
    (rate,) = alike_rates(params, SLOW)
    walks = inside({mu: (rate, mu) for mu in FRICTIONS}, params, samples)
    use = friction_use(steady(params, phases(samples), rate))
    claims = [
        least_friction(walks, use),
        onset(walks),
        end(walks, swing_heights(params, samples)),
        second(walks),
        repeatedly(walks),
    ]
    return _result("μ = {:g}", walks, claims)


def speeds(params: BipedParams, samples: int) -> Result:
    """Fig. 18."""
    rates = alike_rates(params, *RATES)
    walks = inside({rate: (rate, RATE_FRICTION) for rate in rates}, params, samples)
    return _result("{:g} rad/s", walks, [])


def kinetic(params: BipedParams, samples: int) -> Result:
    """Fig. 19."""
    (rate,) = alike_rates(params, FAST)
    walks = inside({mu: (rate, STATIC, mu) for mu in KINETIC}, params, samples)
    claims = [
        first_onset(walks),
        later_onsets(walks),
        smaller_slide(walks),
    ]
    return _result("μk = {:g}", walks, claims)


def inside(
    asked: Mapping[float, tuple[float, ...]], params: BipedParams, samples: int
) -> dict[float, Walk]:
    """The walks that stay in the model, by the number that varies. ValueError where none does.

    asked: crank rate and frictions of each.
    """
    walks, why = {}, ""
    for name, numbers in asked.items():
        try:
            walks[name] = walk(params, *numbers, samples=samples)
        except ValueError as error:
            why = str(error)
            say_stage(f"not drawn: {why}")
    if not walks:
        raise ValueError(why)
    return walks


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


def least_friction(walks: Walks, use: np.ndarray) -> Claim:
    """use: |f| / N over a step without slip [n]."""
    least = peak_of(use)[1]
    slips = max((mu for mu, one in walks.items() if one.slides), default=0.0)
    stays = min((mu for mu, one in walks.items() if not one.slides), default=np.inf)
    measured = (
        f"{least:.5f} = largest |f| / N; the walks slip up to {slips:g} and not from {stays:g} on"
    )
    return claim("fig17", "least_friction", measured)


def onset(walks: Walks) -> Claim:
    """Fig. 17: onset of the slide nearest to mid-step."""
    found = {mu: _main(one) for mu, one in walks.items() if one.slides}
    shown = (f"{s.onset:.3f} ({mu:g})" if s else f"none ({mu:g})" for mu, s in found.items())
    return claim("fig17", "onset", f"onset, in T: {', '.join(shown)}")


def end(walks: Walks, high: Mapping[str, float]) -> Claim:
    """high: where in the step parts of the swinging leg are highest, by name [T]."""
    ends = {mu: s.stop for mu, one in walks.items() if (s := _main(one)) is not None}
    near = {name: [abs(at - when) < NEAR for at in ends.values()] for name, when in high.items()}
    heights = ", ".join(
        f"{name} at {when:.3f} T ({sum(near[name])} of {len(ends)} slides end near)"
        for name, when in high.items()
    )
    ended = each("{:.3f} ({:g})", ends)
    measured = f"ends at {ended} T; highest are the swinging leg's {heights}"
    return claim("fig17", "end", measured)


def second(walks: Walks) -> Claim:
    """Fig. 17: the slides that are not nearest to mid-step."""
    starts = [(mu, s, _main(one)) for mu, one in walks.items() for s in one.starting_in(SECOND)]
    others = [(mu, slide) for mu, slide, main in starts if slide is not main]
    shown = ", ".join(f"{s.onset:.3f} to {s.stop:.3f} ({mu:g})" for mu, s in others)
    return claim("fig17", "second", f"the other slides, in T: {shown or 'none'}")


def repeatedly(walks: Walks) -> Claim:
    """Fig. 17: slides of the least friction."""
    found = walks[min(walks)].within(SECOND)
    sliding = sum(s.end - s.start for s in found)
    shown = ", ".join(
        f"{s.onset:.3f} to {s.stop:.3f} T {'forwards' if s.displacement > 0 else 'backwards'}"
        for s in found
    )
    measured = f"{len(found)} slides in the second step, {100 * sliding:.0f} % of its time: {shown}"
    return claim("fig17", "repeatedly", measured)


def first_onset(walks: Walks) -> Claim:
    """Fig. 19: before the first slide kinetic friction does not enter."""
    first = [one.slides[0].start if one.slides else np.inf for one in walks.values()]
    spread = float(np.ptp(first)) if np.all(np.isfinite(first)) else np.inf
    measured = f"first onset at {min(first):.4f} T, apart by {spread:.1g} T"
    return claim("fig19", "first_onset", measured)


def later_onsets(walks: Walks) -> Claim:
    """Fig. 19: where slides start when the foot has slid before."""
    onsets = {mu: [s.onset for s in one.starting_in(SECOND)] for mu, one in walks.items()}
    shown = "; ".join(
        f"{', '.join(f'{at:.3f}' for at in found) or 'none'} for {mu:g}"
        for mu, found in onsets.items()
    )
    return claim("fig19", "later_onsets", f"onsets in the second step, in T: {shown}")


def smaller_slide(walks: Walks) -> Claim:
    """Fig. 19: distance slid and displacement; walks by falling kinetic friction."""
    net = [one.displacement for one in walks.values()]
    shown = each(
        "{:.2f} mm for {:g}", {mu: 1e3 * one.distance(SECOND) for mu, one in walks.items()}
    )
    measured = (
        f"distance slid in the second step {shown}; displacement after {PERIODS} steps "
        f"{', '.join(f'{1e3 * at:+.2f}' for at in net)} mm"
    )
    return claim("fig19", "smaller_slide", measured)


def _main(walk: Walk) -> Slide | None:
    """The slide that starts in the second step nearest to mid-step."""
    return min(walk.starting_in(SECOND), key=lambda s: abs(s.onset - 0.5), default=None)


def _result(name: str, walks: Walks, claims: list[Claim]) -> Result:
    """Places of the foot by the number that varies; name: of a curve."""
    named = {name.format(x): 1e3 * one.place for x, one in walks.items()}
    time = next(iter(walks.values())).time
    return Result(TIME, time, [curves("foot position", "mm", named)], claims)
