"""Walks at a constant crank rate with a foot that may slip (Fig. 16), and the slides in them.

A slide runs from an instant of slip to the next instant of stick, always one way. Displacement is
signed, forwards positive; the way slid adds up distances, whichever way they go.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stickslip.dynamics.biped import (
    BipedParams,
    BipedState,
    RK4Split,
    Trajectory,
    simulate_inverse,
)
from stickslip.dynamics.biped.fidelity import Fidelity
from stickslip.dynamics.biped.stepping.integrators import Integrator
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status

PERIODS = 4
"""Steps that the walks of Figs. 16 to 19 last."""
SAME_INSTANT = 1e-6
"""A slide that starts this close to an exchange of support starts with it [T]."""


@dataclass(frozen=True)
class Slide:
    """One slide of the foot, or the part of it in one step. start, end: in steps, t / T. onset: the
    start's place in its step, from 0 to 1. displacement: of the foot over the floor, forwards
    positive [m]. ended: False if the walk ended first."""

    start: float
    end: float
    displacement: float
    ended: bool = True

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
    """A walk at constant crank rate. period: T = pi / rate [s]. share: times in T [n + 1].
    place: of the foot, x1, forwards positive [n + 1, m]."""

    period: float
    share: np.ndarray
    place: np.ndarray
    slides: tuple[Slide, ...]

    @property
    def displacement(self) -> float:
        """Of the foot over the whole walk, forwards positive [m]."""
        return float(self.place[-1] - self.place[0])

    def starting_in(self, step: int) -> tuple[Slide, ...]:
        """The slides that start in a step, counted from 0, whole: they may end in the next one."""
        return tuple(one for one in self.slides if one.step == step)

    def within(self, step: int) -> tuple[Slide, ...]:
        """The slides of a step, counted from 0, cut off where the step begins and ends."""
        parts, origin = [], float(self.place[0])
        for one in self.slides:
            start, end = max(one.start, float(step)), min(one.end, step + 1.0)
            reached = origin + one.displacement
            if end - start > SAME_INSTANT:
                left = origin if start == one.start else self._at(start)
                right = reached if end == one.end else self._at(end)
                parts.append(Slide(start, end, right - left, one.ended))
            origin = reached
        return tuple(parts)

    def way(self, step: int) -> float:
        """Distance that the foot slides within a step, forwards and backwards added up [m]."""
        return sum(abs(one.displacement) for one in self.within(step))

    def _at(self, share: float) -> float:
        """The foot's place at an exchange of support, where a sample is [m]."""
        return float(np.interp(share, self.share, self.place))


def walk(
    params: BipedParams,
    crank_rate: float,
    mu_static: float,
    mu_kinetic: float | None = None,
    *,
    samples: int,
    count: int | None = None,
    integrator: Integrator | None = None,
    fidelity: Fidelity = "reduced",
) -> Walk:
    """From the exchange of support with the foot at rest, as in the chapter.

    crank_rate [rad/s]. samples: time steps of the integrator in one step of the biped. count: of
    them in all, PERIODS steps of the biped unless given; a count used before compiles nothing.
    integrator: one with record_events=True, RK4Split if none is given. The motor's torque is
    whatever the motion needs, so the crank's angle and the forces with the foot at rest do not
    depend on the slide.
    """
    period = np.pi / crank_rate
    count = PERIODS * samples if count is None else count
    scene = Scene.uniform(mu_static, mu_kinetic, outputs="state")
    course = simulate_inverse(
        params,
        scene,
        BipedState(crank_rate=crank_rate),
        0.0,
        count * period / samples,
        period / samples,
        fidelity=fidelity,
        integrator=integrator or RK4Split(record_events=True),
    )
    if (status := Status(int(course.status))).terminal:
        raise ValueError(
            f"crank_rate = {crank_rate:g} rad/s with friction {mu_static:g} leaves the model "
            f"({status.name}); accepted: walks inside it"
        )
    share = np.asarray(course.states.time) / period
    place = np.asarray(course.states.foot_position)
    return Walk(period, share, place, slides_of(course, period))


def slides_of(course: Trajectory, period: float) -> tuple[Slide, ...]:
    """Pair the instants of slip and stick in a recorded trajectory; times in `period` [s].

    Between two slides the foot rests, so each starts where the one before it ended.
    """
    slips = [time for time, kind, _ in course.events() if kind == "slip"]
    stops = [time for time, kind, _ in course.events() if kind == "stick"]
    slides, place = [], float(course.states.foot_position[0])
    for start, stop, again in zip(slips, stops, [*slips[1:], np.inf], strict=False):
        reached = _resting_place(course, stop, again)
        slides.append(Slide(start / period, stop / period, reached - place))
        place = reached
    last = float(course.final.time)
    if len(slips) > len(stops) and last - slips[-1] > SAME_INSTANT * period:
        way = float(course.final.foot_position) - place
        slides.append(Slide(slips[-1] / period, last / period, way, ended=False))
    return tuple(slides)


def _resting_place(course: Trajectory, stop: float, again: float) -> float:
    """Position at which the foot rests from `stop` until `again` [m].

    If a sample falls in between, it has the place. Else half the speed of a sample is the mean
    speed between it and the rest, to third order in the distance: the nearer sample counts more.
    """
    times = np.asarray(course.states.time)
    after = int(np.clip(np.searchsorted(times, stop), 1, len(times) - 1))
    before = after - 1
    slide, speed = (
        np.asarray(column)[[before, after]]
        for column in (course.states.foot_position, course.states.foot_velocity)
    )
    if again >= times[after]:
        return float(slide[1])
    early, late = stop - times[before], times[after] - again
    by_before, by_after = slide[0] + speed[0] * early / 2, slide[1] - speed[1] * late / 2
    return float((late**3 * by_before + early**3 * by_after) / (late**3 + early**3))
