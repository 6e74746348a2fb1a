"""Claims of Figs. 17 and 19 about slides, judged by walks at constant crank rate.

They are judged by the second step: the first begins with the foot at rest.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.paper.figure import Claim, by_calibration, by_construction, share_of, verdict_of
from stickslip.paper.torque import peak_of
from stickslip.paper.walks import PERIODS, SAME_INSTANT, Slide, Walk

STATED_FRICTION = 0.08
MID_STEP = (0.4, 0.6)
"""Range that counts as "at mid-step", as shares of the step [-]."""
QUARTER = 0.25
NEAR = 0.05
"""A slide ends "when the leg is highest" if it does so within this time [T]."""
SECOND = 1
"""The second step, counted from 0."""
SAME = 5e-3
"""Onsets closer than this count as the same [T]."""

Walks = Mapping[float, Walk]
"""Walks by the number that varies."""


def least_friction(walks: Walks, use: np.ndarray, crank_rate: float) -> Claim:
    """use: |f| / N over a step without slip [n]."""
    least = peak_of(use)[1]
    slips = max((mu for mu, one in walks.items() if one.slides), default=0.0)
    stays = min((mu for mu, one in walks.items() if not one.slides), default=np.inf)
    return Claim(
        f"{STATED_FRICTION:g} is the least friction that prevents slip at {crank_rate:g} rad/s",
        f"{least:.5f} = largest |f| / N; the walks slip up to {slips:g} and not from {stays:g} on",
        by_calibration(round(least, 2) == STATED_FRICTION and slips < least <= stays),
        "the hip's mass and the bars' density were chosen for this number; that the walks agree "
        "with the largest |f| / N checks the computation",
    )


def onset(walks: Walks) -> Claim:
    """Fig. 17: onset of the slide nearest to mid-step."""
    found = {mu: _main(one) for mu, one in walks.items() if one.slides}
    low, high = MID_STEP
    return Claim(
        "sliding starts at mid-step",
        "onset, in T: "
        + ", ".join(
            f"{s.onset:.3f} ({mu:g})" if s else f"none ({mu:g})" for mu, s in found.items()
        ),
        share_of(s is not None and low < s.onset < high for s in found.values()),
        f"near the peak of |f| / N; mid-step: {low:g} to {high:g} T",
    )


def end(walks: Walks, high: Mapping[str, float]) -> Claim:
    """high: where in the step parts of the swinging leg are highest, by name [T]."""
    ends = {mu: s.stop for mu, one in walks.items() if (s := _main(one)) is not None}
    near = {name: [abs(at - when) < NEAR for at in ends.values()] for name, when in high.items()}
    heights = ", ".join(
        f"{name} at {when:.3f} T ({sum(near[name])} of {len(ends)} slides end near)"
        for name, when in high.items()
    )
    return Claim(
        "and lasts until the swinging leg is highest",
        f"ends at {', '.join(f'{at:.3f} ({mu:g})' for mu, at in ends.items())} T; highest are the "
        f"swinging leg's {heights}",
        share_of(max(near.values(), key=sum)),
        f"less friction, later end; agrees: all end within {NEAR:g} T of one of these heights",
    )


def second(walks: Walks) -> Claim:
    """Fig. 17: the slides that are not nearest to mid-step."""
    others = [
        (mu, slide)
        for mu, one in walks.items()
        for slide in one.starting_in(SECOND)
        if slide is not _main(one)
    ]
    shown = ", ".join(f"{s.onset:.3f} to {s.stop:.3f} ({mu:g})" for mu, s in others)
    return Claim(
        "if there are two slides, the other one is in the first quarter",
        f"the other slides, in T: {shown or 'none'}",
        share_of(s.stop <= QUARTER for mu, s in others if mu > min(walks)),
        f"|f| / N jumps at the exchange of support; in it: over by {QUARTER:g} T, without "
        f"{min(walks):g}",
    )


def repeatedly(walks: Walks) -> Claim:
    """Fig. 17: slides of the least friction."""
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
        "repeatedly: three slides or more; partly: more than half of the time",
    )


def first_onset(walks: Walks) -> Claim:
    """Fig. 19: before the first slide kinetic friction does not enter."""
    first = [one.slides[0].start if one.slides else np.inf for one in walks.values()]
    spread = float(np.ptp(first)) if np.all(np.isfinite(first)) else np.inf
    return Claim(
        f"slips at the same point for μk = {', '.join(f'{mu:g}' for mu in walks)}",
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
    first, *others = onsets.values()
    common = [at for at in first if all(_has(found, at) for found in others)]
    same = common and all(len(found) == len(common) for found in onsets.values())
    return Claim(
        "(the same point, once the foot has slid)",
        f"onsets in the second step, in T: {shown}",
        verdict_of(same, common),
        "low μk makes one slide run into the next; agrees: the same onsets; partly: one that all "
        "share",
    )


def smaller_slide(walks: Walks) -> Claim:
    """Fig. 19: distance slid and displacement; walks by falling kinetic friction."""
    distances = [[one.distance(step) for one in walks.values()] for step in range(PERIODS)]
    net = [one.displacement for one in walks.values()]
    farther = np.all(np.diff(distances, axis=1) > 0)
    more_net = np.all(np.diff(np.abs(net)) > 0)
    shown = ", ".join(
        f"{1e3 * far:.2f} mm for {mu:g}" for mu, far in zip(walks, distances[SECOND], strict=True)
    )
    return Claim(
        "the bigger μk, the smaller the slide",
        f"distance slid in the second step {shown}; displacement after {PERIODS} steps "
        f"{', '.join(f'{1e3 * at:+.2f}' for at in net)} mm",
        verdict_of(farther and more_net, farther or more_net),
        f"agrees: less distance in each of {PERIODS} steps and less displacement, forwards or "
        "backwards; partly: one of the two",
    )


def _main(walk: Walk) -> Slide | None:
    """Of the slides that start in the second step, the one that starts nearest to mid-step."""
    return min(walk.starting_in(SECOND), key=lambda s: abs(s.onset - 0.5), default=None)


def _has(onsets: list[float], at: float) -> bool:
    return any(abs(one - at) < SAME for one in onsets)
