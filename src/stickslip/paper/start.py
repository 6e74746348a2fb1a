"""Figs. 13 and 14: from rest at pi/2, both feet on the floor, under a constant torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stickslip.dynamics.biped import BipedParams, BipedState, Trajectory, simulate
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.optim.gait.footing import peak_of
from stickslip.optim.progress import Bar
from stickslip.paper.result import (
    Claim,
    Result,
    claim,
    curves,
)
from stickslip.paper.steady import alike_masses, phases, steady

TORQUES = (0.70, 0.80, 0.84, 0.845, 0.90, 1.0, 1.2)
DURATION = 4.0
"""Seconds drawn."""
PATIENCE = 20.0
"""A torque that has not ended the first step after this time does not walk [s]."""
MOST, TOLERANCE = 2.0, 1e-4
"""Of the bisection for the reference robot's least torque [N m]."""
CLOSE = 400
"""Crank angles of a step for the start torque."""
TORQUE = 1.0
WEIGHTS = (6.0, 7.0, 8.0, 9.0, 10.0, 10.5)
"""Total masses of Fig. 14 [kg]."""
SCENE = Scene.grip(outputs="state")


def torques(params: BipedParams, samples: int) -> Result:
    """Fig. 13."""
    drawn, least = alike_torques(params, *TORQUES), least_torque(params, samples)
    walks = {f"{torque:g} N m": from_rest(params, torque, DURATION, samples) for torque in drawn}
    return _result(walks, starts_at(least, torque_by_work(params, samples)))


def alike_torques(params: BipedParams, *torques: float) -> list[float]:
    """The chapter's torques in proportion to the robot's start torque [N m], to three digits."""
    factor = torque_by_work(params, CLOSE) / torque_by_work(BipedParams.from_bars(), CLOSE)
    return [float(f"{factor * torque:.3g}") for torque in torques]


def weights(params: BipedParams, samples: int) -> Result:
    """Fig. 14, with all densities, so masses and moments of inertia, scaled alike."""
    own, walks, (torque,) = float(params.total_mass), {}, alike_torques(params, TORQUE)
    for mass in alike_masses(params, *WEIGHTS):
        factor, scaled = mass / own, ("mass", "inertia", "payload")
        denser = replace(params, **{name: getattr(params, name) * factor for name in scaled})
        walks[mass] = from_rest(denser, torque, DURATION, samples)
    step = {mass: first_step(walk) for mass, walk in walks.items()}
    found = heavier(step, own, torque_by_work(params, samples), torque)
    return _result({f"{mass:g} kg": walk for mass, walk in walks.items()}, found)


def from_rest(params: BipedParams, torque: float, duration: float, samples: int) -> Trajectory:
    """A constant torque [N m] for `duration` [s] in 4 x samples steps, from rest at pi/2, no slip.

    As in the chapter, toppling is not checked.
    """
    return simulate(params, SCENE, BipedState(), torque, duration, duration / (4 * samples))


def first_step(walk: Trajectory) -> float:
    """End of the first step [s], interpolated between samples; infinite if it does not end."""
    angle, time = np.asarray(walk.states.crank_angle), np.asarray(walk.states.time)
    past = np.nonzero(angle >= 3 * np.pi / 2)[0]
    if len(past) == 0:
        return float("inf")
    i = int(past[0])
    share = (3 * np.pi / 2 - angle[i - 1]) / (angle[i] - angle[i - 1])
    return float(time[i - 1] + share * (time[i] - time[i - 1]))


def least_torque(params: BipedParams, samples: int) -> float:
    """The least torque that walks the first step [N m], by bisection up to what surely does."""
    low, (high,) = 0.0, alike_torques(params, MOST)
    halvings = math.ceil(math.log2(MOST / TOLERANCE))
    with Bar("bisection", halvings, "walk", True) as bar:
        for _ in range(halvings):
            middle = (low + high) / 2
            walks = np.isfinite(first_step(from_rest(params, middle, PATIENCE, samples)))
            low, high = (low, middle) if walks else (middle, high)
            bar.advance()
    return high


def torque_by_work(params: BipedParams, samples: int) -> float:
    """The least torque that walks [N m], by the balance of work.

    From rest, M w^2 / 2 = T (theta - pi/2) - (V(theta) - V(pi/2)): the crank gets past every phase
    if T is above the greatest mean slope of V. MODEL 1.4, with V' = g Y the torque at rest.
    """
    slope = np.asarray(steady(params, phases(samples), 0.0).torque)
    bend = np.gradient(slope, edge_order=2)
    rise = np.cumsum((slope[1:] + slope[:-1]) / 2) - (bend[1:] - bend[0]) / 12  # Euler-Maclaurin
    return peak_of(rise / np.arange(1, samples + 1))[1]


def starts_at(least: float, by_work: float) -> Claim:
    """least: by bisection; by_work: by the balance of work; both [N m]."""
    measured = f"{least:.4f} N m by bisection of walks, {by_work:.4f} N m by the balance of work"
    return claim("fig13", "starts_at", measured)


def heavier(step: Mapping[float, float], own: float, least: float, torque: float) -> Claim:
    """step: end of the first step by mass, rising [s]. own: the robot's mass [kg]. least: the
    torque that it needs by the balance of work [N m], torque: that it has [N m]."""
    heaviest = own * torque / least
    walks = {mass: time for mass, time in step.items() if np.isfinite(time)}
    measured = (
        f"first step in {', '.join(f'{time:.3f} s ({mass:g} kg)' for mass, time in walks.items())};"
        f" walks up to {heaviest:.2f} kg = {own:.2f} kg x {torque:g} N m / {least:.4f} N m"
    )
    return claim("fig14", "heavier", measured)


def _result(walks: Mapping[str, Trajectory], found: Claim) -> Result:
    """Crank angles by name, NaN after the walk has left the model."""
    angles = {}
    for name, walk in walks.items():
        angles[name] = np.array(walk.states.crank_angle)
        angles[name][1:][np.asarray(walk.contacts.status) > Status.SLIP_ONSET] = np.nan
    time = DURATION * np.linspace(0, 1, len(next(iter(angles.values()))))
    return Result("time [s]", time, [curves("crank angle", "rad", angles, (np.pi / 2,))], [found])
