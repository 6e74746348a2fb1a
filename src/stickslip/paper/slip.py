"""Figs. 17, 18 and 19: how the supporting foot slides at a constant crank rate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams
from stickslip.envs.rendering import theme
from stickslip.paper import drawing, slip_claims
from stickslip.paper.result import NOT_STATED, Claim, Columns, Result, Setting
from stickslip.paper.torque import peak_of, phases, poses, steady
from stickslip.paper.walks import PERIODS, Walk, walk

SLOW = 3.0
FRICTIONS = (0.03, 0.04, 0.05, 0.06, 0.07, 0.075, 0.079, 0.08, 0.1)
RATES = (3.0, 3.5, 4.0, 4.5, 5.0, 5.5)
RATE_FRICTION = 0.1
FAST, STATIC, KINETIC = 5.0, 0.2, (0.2, 0.1, 0.05)


def frictions(setting: Setting) -> Result:
    """Fig. 17."""
    params = BipedParams.from_bars()
    walks = {}
    for mu in FRICTIONS:
        setting.say(f"friction {mu:g}")
        walks[mu] = walk(params, SLOW, mu, samples=setting.samples)
    use = friction_use(params, SLOW, setting.samples)
    claims = [
        slip_claims.least_friction(walks, use, SLOW),
        slip_claims.onset(walks, peak_of(use)[0]),
        slip_claims.end(walks, swing_heights(params, setting.samples)),
        slip_claims.second(walks, use),
        slip_claims.repeatedly(walks),
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
        f"{1e3 * one.way(1):.2f} mm in {len(one.within(1))} at {w:g}" for w, one in walks.items()
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
            f"way slid within the second step and number of slides: {first} rad/s",
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
    claims = [
        slip_claims.first_onset(walks),
        slip_claims.later_onsets(walks),
        slip_claims.smaller_slide(walks),
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


def _positions(walks: Mapping[str, Walk]) -> Columns:
    every = list(walks.values())
    places = {f"place of the foot, {name} [m]": one.place for name, one in walks.items()}
    return {"time / T [-]": every[0].share, **places}


def _slides(family: Mapping[str, Mapping[float, Walk]]) -> Columns:
    ((name, walks),) = family.items()
    rows = [(value, slide) for value, one in walks.items() for slide in one.slides]
    return {
        name: [value for value, _ in rows],
        "start / T [-]": [slide.start for _, slide in rows],
        "end / T [-]": [slide.end for _, slide in rows],
        "onset in its step [-]": [slide.onset for _, slide in rows],
        "displacement [m]": [slide.displacement for _, slide in rows],
    }


def _draw(walks: Mapping[str, Walk], note: str):
    ratio = 0.07 * (3 + len(walks))
    figure, axes = drawing.sheet(2, height=2.2 + 0.9 * ratio, height_ratios=(1.4, ratio))
    course, bars = axes[:, 0]
    for (name, one), colour in zip(walks.items(), drawing.shades(len(walks)), strict=True):
        course.plot(one.share, 1e3 * one.place, color=colour, lw=1.4, label=name)
    drawing.legend(course)
    drawing.name_panel(
        course, "place of the foot x1 [mm], forwards up", note, "time in steps, t / T"
    )
    course.set_xlim(0, PERIODS)
    for row, (one, colour) in enumerate(
        zip(walks.values(), drawing.shades(len(walks)), strict=True)
    ):
        for part in one.within(1):
            look = {"height": 0.75, "color": colour, "edgecolor": theme.PANEL}
            bars.barh(row, part.end - part.start, left=part.start - 1, **look)
    bars.set_yticks(range(len(walks)), list(walks), fontsize=7)
    bars.set_ylim(len(walks) - 0.5, -0.5)
    bars.set_xlim(0, 1)
    drawing.name_panel(bars, "when it slides in a step", "the second step", "share of the step")
    return figure
