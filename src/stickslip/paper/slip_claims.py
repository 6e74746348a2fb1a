"""Claims about the slides of Figs. 17 and 19, judged by walks at constant crank rate.

They are looked at in the second step: the first begins with the foot at rest.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.paper.result import Claim, by_calibration, by_construction, share_of, verdict_of
from stickslip.paper.torque import peak_of
from stickslip.paper.walks import PERIODS, SAME_INSTANT, Slide, Walk

STATED_FRICTION = 0.08
MID_STEP = (0.4, 0.6)
"""Range that counts as "at mid-step", as shares of the step [-]."""
QUARTER = 0.25
NEAR = 0.05
"""A slide ends "when the leg is highest" if it does so within this time [T]."""
SECOND = 1
"""The step looked at, counted from 0."""
APART = 5e-3
"""Onsets closer than this count as the same [T]."""

Walks = Mapping[float, Walk]
"""Walks by the number that varies."""


def least_friction(walks: Walks, use: np.ndarray, crank_rate: float) -> Claim:
    """use: |f| / N over a step without slip [n]."""
    place, least = peak_of(use)
    slips = max((mu for mu, one in walks.items() if one.slides), default=0.0)
    stays = min((mu for mu, one in walks.items() if not one.slides), default=np.inf)
    met = round(least, 2) == STATED_FRICTION and slips < least <= stays
    return Claim(
        f"{STATED_FRICTION:g} is the least friction that prevents slip at {crank_rate:g} rad/s",
        f"{least:.5f} = largest |f| / N, at {place:.3f} T; the walks slip up to {slips:g} and do "
        f"not from {stays:g} on",
        by_calibration(met),
        "the hip's mass and the bars' density were chosen for this number; that the walks, which "
        "look for slip at every step, agree with the largest |f| / N checks the computation",
    )


def onset(walks: Walks, peak: float) -> Claim:
    """peak: where in the step |f| / N is largest without slip [T]."""
    found = {mu: _main(one) for mu, one in walks.items() if one.slides}
    shown = "; ".join(
        f"{s.onset:.3f} ({mu:g})" if s else f"none ({mu:g})" for mu, s in found.items()
    )
    low, high = MID_STEP
    return Claim(
        "sliding starts at mid-step",
        f"onset nearest to mid-step, in T of the second step (at μ): {shown}",
        share_of(s is not None and low < s.onset < high for s in found.values()),
        f"the peak of |f| / N is at {peak:.3f} T: less friction, earlier onset, except where the "
        f"foot is still sliding from before; counted as mid-step: {low:g} to {high:g} T",
    )


def end(walks: Walks, high: Mapping[str, float]) -> Claim:
    """high: where in the step parts of the swinging leg are highest, by name [T]."""
    ends = {mu: s.stop for mu, one in walks.items() if (s := _main(one)) is not None}
    near = {name: [abs(at - when) < NEAR for at in ends.values()] for name, when in high.items()}
    shown = "; ".join(f"{at:.3f} ({mu:g})" for mu, at in ends.items())
    heights = ", ".join(
        f"its {name} at {when:.3f} T ({sum(near[name])} of {len(ends)} slides end near)"
        for name, when in high.items()
    )
    return Claim(
        "and lasts until the swinging leg is highest",
        f"these slides end at {shown} T; highest are, of the swinging leg, {heights}",
        share_of(max(near.values(), key=sum)),
        "a slide ends when friction has used up the momentum, later the lower μ is; no one height "
        "fixes it. Just below the least friction a slide is short and ends where it starts, near "
        "the peak of |f| / N. Agrees: all end near one of these heights; partly: some do. Counted "
        f"as near: within {NEAR:g} T",
    )


def second(walks: Walks, use: np.ndarray) -> Claim:
    """use: |f| / N over a step without slip [n], ends included."""
    least = min(walks)
    others = {
        mu: other
        for mu, one in walks.items()
        for other in one.starting_in(SECOND)
        if other is not _main(one)
    }
    shown = "; ".join(f"{s.onset:.3f} to {s.stop:.3f} ({mu:g})" for mu, s in others.items())
    return Claim(
        "if there are two slides, the other one is in the first quarter",
        f"the other slides of the second step, in T (at μ): {shown or 'none'}",
        share_of(s.stop <= QUARTER for mu, s in others.items() if mu > least),
        f"|f| / N jumps from {use[-1]:.3f} to {use[0]:.3f} at the exchange of support, as the legs "
        "change roles: the foot breaks loose the moment it takes the weight. Counted as in it: "
        f"over by {QUARTER:g} T; {least:g} is in the next row",
    )


def repeatedly(walks: Walks) -> Claim:
    """Of the least friction."""
    mu = min(walks)
    found = walks[mu].within(SECOND)
    sliding = sum(s.end - s.start for s in found)
    shown = ", ".join(
        f"{s.onset:.3f} to {s.stop:.3f} T {'forwards' if s.displacement > 0 else 'backwards'}"
        for s in found
    )
    return Claim(
        f"for μ = {mu:g} slip occurs repeatedly at various phases",
        f"{len(found)} slides in the second step, {100 * sliding:.0f} % of its time: {shown}",
        verdict_of(len(found) > 2, sliding > 0.5),
        "one slide turns into the next without rest, the second lasts almost until the exchange. "
        "Counted as repeatedly: three slides or more; as partly: more than half of the time",
    )


def first_onset(walks: Walks) -> Claim:
    """Fig. 19: before the first slide kinetic friction does not enter."""
    first = [one.slides[0].start if one.slides else np.inf for one in walks.values()]
    slips = bool(np.all(np.isfinite(first)))
    spread = float(np.ptp(first)) if slips else np.inf
    return Claim(
        f"slips at the same point for μk = {_names(walks)}",
        f"first onset at {min(first):.4f} T, apart by {spread:.1g} T",
        by_construction(spread < SAME_INSTANT),
        "until the foot first slips, μk does not enter: the same for any robot",
    )


def later_onsets(walks: Walks) -> Claim:
    """Fig. 19: where slides start once the foot has slid before."""
    onsets = {mu: [s.onset for s in one.starting_in(SECOND)] for mu, one in walks.items()}
    shown = "; ".join(
        f"{', '.join(f'{at:.3f}' for at in found) or 'none'} for {mu:g}"
        for mu, found in onsets.items()
    )
    every = list(onsets.values())
    common = [at for at in every[0] if all(_has(found, at) for found in every)]
    same = common and all(len(found) == len(common) for found in every)
    return Claim(
        "(the same point, once the foot has slid)",
        f"onsets in the second step, in T: {shown}",
        verdict_of(same, common),
        "at constant crank rate a slide from rest starts at a phase that μk does not enter either; "
        "but the foot must have come to rest before, and low μk makes one slide run into the next. "
        f"Agrees: the same onsets to {APART:g} T; partly: one that all share",
    )


def smaller_slide(walks: Walks) -> Claim:
    """Fig. 19: way slid and displacement; walks by falling kinetic friction."""
    ways = [[one.way(step) for one in walks.values()] for step in range(PERIODS)]
    net = [one.displacement for one in walks.values()]
    longer = np.all(np.diff(ways, axis=1) > 0, axis=1)
    less_way = bool(np.all(longer))
    less_net = bool(np.all(np.diff(np.abs(net)) > 0))
    shown = ", ".join(
        f"{1e3 * way:.2f} mm for {mu:g}" for mu, way in zip(walks, ways[SECOND], strict=True)
    )
    return Claim(
        "the bigger μk, the smaller the slide",
        f"way slid within the second step {shown}, longer with less μk in {np.sum(longer)} of "
        f"{PERIODS} steps; displacement after {PERIODS} steps, forwards "
        f"positive, {', '.join(f'{1e3 * at:+.2f}' for at in net)} mm",
        verdict_of(less_way and less_net, less_way or less_net),
        "friction takes the foot's speed away; where slides go both ways, a longer way can end "
        f"nearer to the start. Agrees: less way in each of the {PERIODS} steps and less "
        "displacement, whichever way; partly: one of the two",
    )


def _main(walk: Walk) -> Slide | None:
    """Of the slides that start in the second step, the one that starts nearest to mid-step."""
    return min(walk.starting_in(SECOND), key=lambda s: abs(s.onset - 0.5), default=None)


def _has(onsets: list[float], at: float) -> bool:
    return any(abs(one - at) < APART for one in onsets)


def _names(walks: Walks) -> str:
    *head, last = [f"{mu:g}" for mu in walks]
    return f"{', '.join(head)} and {last}"
