"""Walks at a constant crank rate with a foot that may slip, and the slides in them.

A slide runs from an instant of slip to the next instant of stick, always in one direction.
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
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status

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
                left = origin if start == one.start else self._at(start)
                right = reached if end == one.end else self._at(end)
                parts.append(Slide(start, end, right - left))
            origin = reached
        return tuple(parts)

    def distance(self, step: int) -> float:
        """Distance slid within a step, forwards and backwards added up [m]."""
        return sum(abs(one.displacement) for one in self.within(step))

    def _at(self, time: float) -> float:
        """The foot's place at an exchange of support, where a sample is [m]."""
        return float(np.interp(time, self.time, self.place))


def walk(
    params: BipedParams,
    crank_rate: float,
    mu_static: float,
    mu_kinetic: float | None = None,
    *,
    samples: int,
) -> Walk:
    """Walk from the exchange of support with the foot at rest, as in the chapter.

    crank_rate [rad/s]. samples: time steps in each of the PERIODS steps of the biped. The motor
    gives the torque that the motion needs.
    """
    period = np.pi / crank_rate
    trajectory = simulate_inverse(
        params,
        Scene.uniform(mu_static, mu_kinetic, outputs="state"),
        BipedState(crank_rate=crank_rate),
        0.0,
        PERIODS * period,
        period / samples,
        integrator=RK4Split(record_events=True),
    )
    if (status := Status(int(trajectory.status))).terminal:
        raise ValueError(
            f"crank_rate = {crank_rate:g} rad/s with friction {mu_static:g} leaves the model "
            f"({status.name}); accepted: walks inside it"
        )
    time = np.asarray(trajectory.states.time) / period
    place = np.asarray(trajectory.states.foot_position)
    return Walk(period, time, place, slides_of(trajectory, period))


def slides_of(trajectory: Trajectory, period: float) -> tuple[Slide, ...]:
    """Pair the instants of slip and stick in a recorded trajectory; times in `period` [s].

    Between two slides the foot rests, so each starts where the one before it ended.
    """
    events = trajectory.events()
    times, places = (
        np.asarray(of) for of in (trajectory.states.time, trajectory.states.foot_position)
    )
    slips, stops = ([time for time, of, _ in events if of == kind] for kind in ("slip", "stick"))
    slides, place = [], float(places[0])
    following = [*slips[1:], np.inf]
    for start, stop, later in zip(slips, [*stops, times[-1]], following, strict=False):
        after = min(int(np.searchsorted(times, stop)), len(times) - 1)
        rests = times[after] <= later  # else no sample is at rest
        reached = float(places[after] if rests else np.interp(stop, times, places))
        if stop - start > SAME_INSTANT * period:
            slides.append(Slide(start / period, stop / period, reached - place))
        place = reached
    return tuple(slides)
