"""Figs. 16 to 19: how the supporting foot slides at a constant crank rate.

A slide runs from an instant of slip to the next instant of stick, always in one direction. Claims
are about the second step: the first begins with the foot at rest.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from stickslip.agents.pictures.episodes import panel as curves
from stickslip.dynamics import biped
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.gait.footing import Footing, peak_of
from stickslip.optim.progress import say_stage
from stickslip.paper.result import Result, each
from stickslip.paper.steady import TIME, alike, phases, poses

PERIODS = 4
"""Steps that the walks of Figs. 16 to 19 last."""
SAME_INSTANT = 1e-6
"""A slide that starts this close to an exchange of support starts with it [T]."""


@dataclass(frozen=True)
class Slide:
    """One slide of the foot, or the part of it in one step. start, end: in steps, t / T.
    displacement: of the foot, forwards positive [m]."""

    start: float
    end: float
    displacement: float

    @property
    def step(self) -> int:
        """The step in which it starts, counted from 0. An exchange of support starts a step."""
        return int(np.floor(self.start + SAME_INSTANT))

    @property
    def onset(self) -> float:
        """Share of its step at which the slide starts [-]."""
        return max(self.start - self.step, 0.0)

    @property
    def stop(self) -> float:
        """The end counted from the start of the step in which the slide starts [-]."""
        return self.end - self.start + self.onset


@dataclass(frozen=True)
class Walk:
    """A walk at constant crank rate. period: T = pi / rate [s]. time: in T [n + 1].
    place: of the foot, x1, forwards positive [n + 1, m]."""

    period: float
    time: np.ndarray
    place: np.ndarray
    slides: tuple[Slide, ...]

    @property
    def displacement(self) -> float:
        """Displacement of the foot over the whole walk, forwards positive [m]."""
        return float(self.place[-1] - self.place[0])

    def starting_in(self, step: int) -> tuple[Slide, ...]:
        """The slides that start in a step, counted from 0; they may end in the next one."""
        return tuple(one for one in self.slides if one.step == step)

    def within(self, step: int) -> tuple[Slide, ...]:
        """The slides of a step, counted from 0, cut off where the step begins and ends."""
        parts, origin = [], float(self.place[0])
        for one in self.slides:
            start, end = max(one.start, float(step)), min(one.end, step + 1.0)
            reached = origin + one.displacement
            if end - start > SAME_INSTANT:
                here, there = np.interp((start, end), self.time, self.place)
                left = origin if start == one.start else float(here)
                right = reached if end == one.end else float(there)
                parts.append(Slide(start, end, right - left))
            origin = reached
        return tuple(parts)

    def distance(self, step: int) -> float:
        """Distance slid within a step, forwards and backwards added up [m]."""
        return sum(abs(one.displacement) for one in self.within(step))


def walk(
    params: biped.BipedParams,
    crank_rate: float,
    mu_static: float,
    mu_kinetic: float | None = None,
    *,
    samples: int,
) -> Walk:
    """Walk PERIODS steps at a constant crank rate [rad/s], from the exchange of support with the
    foot at rest, as in the chapter. samples: time steps in each step of the biped."""
    period = np.pi / crank_rate
    scene = Scene.uniform(mu_static, mu_kinetic, outputs="state")
    times, integrator = (PERIODS * period, period / samples), biped.RK4Split(record_events=True)
    state = biped.BipedState(crank_rate=crank_rate)
    trajectory = biped.simulate_inverse(params, scene, state, 0.0, *times, integrator=integrator)
    if (status := Status(int(trajectory.status))).terminal:
        raise ValueError(
            f"crank_rate = {crank_rate:g} rad/s with friction {mu_static:g} leaves the model "
            f"({status.name}); accepted: walks inside it"
        )
    time = np.asarray(trajectory.states.time) / period
    place = np.asarray(trajectory.states.foot_position)
    return Walk(period, time, place, slides_of(trajectory, period))


def slides_of(trajectory: biped.Trajectory, period: float) -> tuple[Slide, ...]:
    """Pair the instants of slip and stick in a recorded trajectory; times in `period` [s].

    Between two slides the foot rests, so each starts where the one before it ended.
    """
    events, states = trajectory.events(), trajectory.states
    times, places = np.asarray(states.time), np.asarray(states.foot_position)
    slips, stops = ([time for time, of, _ in events if of == kind] for kind in ("slip", "stick"))
    slides, place = [], float(places[0])
    for start, stop, later in zip(slips, [*stops, times[-1]], [*slips[1:], np.inf], strict=False):
        after = min(int(np.searchsorted(times, stop)), len(times) - 1)
        rests = times[after] <= later  # else no sample is at rest
        reached = float(places[after] if rests else np.interp(stop, times, places))
        if stop - start > SAME_INSTANT * period:
            slides.append(Slide(start / period, stop / period, reached - place))
        place = reached
    return tuple(slides)


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


def states(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 16."""
    (rate,) = alike(params, "rate", SLOW)
    one = walk(params, rate, CHART_FRICTION, samples=samples)
    shown = one.time <= STEPS
    time, place = one.time[shown], 1e3 * one.place[shown]
    begun = [of for of in one.slides if of.start < STEPS - SAME_INSTANT]
    rests, named = np.ones(len(time), bool), {}
    for name, sign in ((FORWARDS, 1), (BACKWARDS, -1)):
        slides = np.zeros(len(time), bool)
        for slide in (of for of in begun if of.displacement * sign > 0):
            start, end = slide.start - SAME_INSTANT, slide.end + SAME_INSTANT
            slides |= (time >= start) & (time <= end)
            rests &= (time <= start + 2 * SAME_INSTANT) | (time >= end - 2 * SAME_INSTANT)
        named[name] = np.where(slides, place, np.nan)
    named = {RESTS: np.where(rests, place, np.nan)} | named
    return Result(TIME, time, [curves("foot position", "mm", named)])


def frictions(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 17."""
    (rate,) = alike(params, "rate", SLOW)
    walks = inside({mu: (rate, mu) for mu in FRICTIONS}, params, samples)
    slips = max((mu for mu, one in walks.items() if one.slides), default=0.0)
    stays = min((mu for mu, one in walks.items() if not one.slides), default=np.inf)
    least = (
        f"{Footing.of(params).at_rate(rate).friction:.5f} = largest |f| / N; the walks slip up to "
        f"{slips:g} and not from {stays:g} on"
    )
    main = {  # of each walk, the slide that starts in the second step nearest to mid-step
        mu: min(one.starting_in(SECOND), key=lambda s: abs(s.onset - 0.5), default=None)
        for mu, one in walks.items()
        if one.slides
    }
    onsets = (f"{s.onset:.3f} ({mu:g})" if s else f"none ({mu:g})" for mu, s in main.items())
    others = ", ".join(
        f"{s.onset:.3f} to {s.stop:.3f} ({mu:g})"
        for mu, one in walks.items()
        for s in one.starting_in(SECOND)
        if s is not main[mu]
    )
    measured = {
        "least_friction": least,
        "onset": f"onset, in T: {', '.join(onsets)}",
        "end": ends({mu: s.stop for mu, s in main.items() if s}, swing_heights(params, samples)),
        "second": f"the other slides, in T: {others or 'none'}",
        "repeatedly": repeatedly(walks[min(walks)]),
    }
    return _result("μ = {:g}", walks, measured)


def speeds(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 18."""
    rates = alike(params, "rate", *RATES)
    walks = inside({rate: (rate, RATE_FRICTION) for rate in rates}, params, samples)
    return _result("{:g} rad/s", walks, {})


def kinetic(params: biped.BipedParams, samples: int) -> Result:
    """Fig. 19; walks by falling kinetic friction."""
    (rate,) = alike(params, "rate", FAST)
    walks = inside({mu: (rate, STATIC, mu) for mu in KINETIC}, params, samples)
    onsets = {mu: [f"{s.onset:.3f}" for s in one.starting_in(SECOND)] for mu, one in walks.items()}
    shown = "; ".join(f"{', '.join(at) or 'none'} for {mu:g}" for mu, at in onsets.items())
    slid = each("{:.2f} mm for {:g}", {mu: 1e3 * w.distance(SECOND) for mu, w in walks.items()})
    net = ", ".join(f"{1e3 * one.displacement:+.2f}" for one in walks.values())
    measured = {
        "later_onsets": f"onsets in the second step, in T: {shown}",
        "smaller_slide": f"distance slid in the second step {slid}; displacement after {PERIODS} "
        f"steps {net} mm",
    }
    return _result("μk = {:g}", walks, measured)


def inside(
    asked: Mapping[float, tuple[float, ...]], params: biped.BipedParams, samples: int
) -> dict[float, Walk]:
    """The walks inside the model, by the number that varies; asked: crank rate and frictions."""
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


def swing_heights(params: biped.BipedParams, samples: int) -> dict[str, float]:
    """Phases [-] at which the swinging leg's ankle, knee and centre of mass are highest."""
    pose = poses(params, phases(samples))
    swing = [place for place, name in enumerate(biped.BODIES) if name.endswith("p")]
    mass = np.asarray(params.mass)[[int(biped.BODIES[place].rstrip("p")) - 1 for place in swing]]
    ankle, knee = (np.asarray(of)[:, 1, 1] for of in (pose.pins.E, pose.pins.K))
    centre = np.asarray(pose.centres)[:, swing, 1] @ mass
    heights = {"ankle": ankle, "knee": knee, "centre of mass": centre}
    return {name: peak_of(height)[0] for name, height in heights.items()}


def ends(at: Mapping[float, float], high: Mapping[str, float]) -> str:
    """Ends of slides by friction, and when parts of the swinging leg are highest [T], in words."""
    near = {name: sum(abs(one - when) < NEAR for one in at.values()) for name, when in high.items()}
    heights = ", ".join(
        f"{name} at {when:.3f} T ({near[name]} of {len(at)} slides end near)"
        for name, when in high.items()
    )
    ended = each("{:.3f} ({:g})", at)
    return f"ends at {ended} T; highest are the swinging leg's {heights}"


def repeatedly(one: Walk) -> str:
    """The slides in the second step of a walk, in words."""
    found = one.within(SECOND)
    share = 100 * sum(s.end - s.start for s in found)
    shown = ", ".join(
        f"{s.onset:.3f} to {s.stop:.3f} T {'forwards' if s.displacement > 0 else 'backwards'}"
        for s in found
    )
    return f"{len(found)} slides in the second step, {share:.0f} % of its time: {shown}"


def _result(name: str, walks: Mapping[float, Walk], measured: dict[str, str]) -> Result:
    """Places of the foot by the number that varies; name: of a curve."""
    named = {name.format(x): 1e3 * one.place for x, one in walks.items()}
    time = next(iter(walks.values())).time
    return Result(TIME, time, [curves("foot position", "mm", named)], measured)
