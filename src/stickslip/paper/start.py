"""Figs. 13 and 14: from rest at pi/2, both feet on the floor, under a constant torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from stickslip.dynamics.biped import BipedParams, BipedState, Trajectory, simulate
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.paper import drawing
from stickslip.paper.figure import NOT_STATED, Claim, Result, by_calibration, by_construction
from stickslip.paper.torque import peak_of, phases, steady

TORQUES = (0.70, 0.80, 0.84, 0.845, 0.90, 1.0, 1.2)
STATED_TORQUE = 0.84
DURATION = 4.0
"""Seconds drawn."""
PATIENCE = 20.0
"""A torque that has not ended the first step after this time does not walk [s]."""
TOLERANCE = 1e-4
"""To which the least torque is bisected [N m]."""
TORQUE = 1.0
WEIGHTS = (6.0, 7.0, 8.0, 9.0, 10.0, 10.5)
"""Total masses of Fig. 14 [kg]."""
SCENE = Scene.grip(outputs="state")


def torques(samples: int) -> Result:
    """Fig. 13."""
    params = BipedParams.from_bars()
    walks = {torque: from_rest(params, torque, DURATION, samples) for torque in TORQUES}
    least = least_torque(params, samples)
    still = np.asarray(steady(params, phases(samples), 0.0).torque)
    claims = [
        starts_at(least, torque_by_work(params, samples)),
        Claim(
            "(holding still and starting)",
            f"holding still at the steepest phase takes {peak_of(still)[1]:.2f} N m, at pi/2 "
            f"{still[0]:.2f} N m; starting to walk takes {least:.2f} N m",
            NOT_STATED,
            "at pi/2 the weight drives the crank, and its momentum passes the steepest phase",
        ),
        lift_off(walks),
    ]
    return _result({f"{torque:g} N m": walk for torque, walk in walks.items()}, claims)


def weights(samples: int) -> Result:
    """Fig. 14."""
    params = BipedParams.from_bars()
    own = float(params.total_mass)
    walks = {
        mass: from_rest(denser(params, mass / own), TORQUE, DURATION, samples) for mass in WEIGHTS
    }
    step = {mass: first_step(walk) for mass, walk in walks.items()}
    claims = [heavier(step, own, torque_by_work(params, samples))]
    return _result({f"{mass:g} kg": walk for mass, walk in walks.items()}, claims)


def denser(params: BipedParams, factor: float) -> BipedParams:
    """The robot with all densities, so masses and moments of inertia, times `factor`."""
    return replace(params, mass=params.mass * factor, inertia=params.inertia * factor)


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


def least_torque(params: BipedParams, samples: int, tolerance: float = TOLERANCE) -> float:
    """The least torque that walks the first step [N m], by bisection between 0 and 2 N m."""
    low, high = 0.0, 2.0
    while high - low > tolerance:
        middle = (low + high) / 2
        walks = np.isfinite(first_step(from_rest(params, middle, PATIENCE, samples)))
        low, high = (low, middle) if walks else (middle, high)
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
    agree = abs(least - by_work) < TOLERANCE
    return Claim(
        f"the least torque that makes it walk is {STATED_TORQUE:g} N m",
        f"{least:.4f} N m by bisection of walks, {by_work:.4f} N m by the balance of work",
        by_calibration(round(least, 2) == STATED_TORQUE and agree),
        "the hip's mass and the bars' density were chosen for this number; that the two methods "
        f"are less than {TOLERANCE:g} N m apart checks the computation",
    )


def lift_off(walks: Mapping[float, Trajectory]) -> Claim:
    """When constant torques end in lift-off."""
    ended = {
        torque: float(walk.final.time)
        for torque, walk in walks.items()
        if int(walk.status) == Status.LIFT_OFF
    }
    shown = ", ".join(f"{time:.2f} s with {torque:g} N m" for torque, time in ended.items())
    return Claim(
        "(how the curves go on)",
        f"the foot lifts off after {shown}" if shown else f"no lift-off within {DURATION:g} s",
        NOT_STATED,
        "a constant torque above the least one speeds up step by step; the model ends there",
    )


def heavier(step: Mapping[float, float], own: float, least: float) -> Claim:
    """step: end of the first step by mass, rising [s]. own: the robot's mass [kg]. least: the
    torque that it needs by the balance of work [N m]."""
    heaviest = own * TORQUE / least
    walks = {mass: time for mass, time in step.items() if np.isfinite(time)}
    expected = list(walks) == [mass for mass in step if mass < heaviest]
    return Claim(
        "(read as: heavier is slower, and too heavy does not walk)",
        f"first step in {', '.join(f'{time:.3f} s ({mass:g} kg)' for mass, time in walks.items())};"
        f" walks up to {heaviest:.2f} kg = {own:.2f} kg x {TORQUE:g} N m / {least:.4f} N m",
        by_construction(expected and np.all(np.diff(list(walks.values())) > 0)),
        "with all densities scaled alike only torque per weight counts, for any robot",
    )


def _result(walks: Mapping[str, Trajectory], claims: list[Claim]) -> Result:
    """Crank angles by name, NaN after the walk has left the model."""
    angles = {}
    for name, walk in walks.items():
        angles[name] = np.array(walk.states.crank_angle)
        angles[name][1:][np.asarray(walk.contacts.status) > Status.SLIP_ONSET] = np.nan
    time = DURATION * np.linspace(0, 1, len(next(iter(angles.values()))))
    columns = {f"crank angle, {name} [rad]": angle for name, angle in angles.items()}
    return Result({"": {"time [s]": time, **columns}}, lambda: _draw(time, angles), claims)


def _draw(time: np.ndarray, angles: Mapping[str, np.ndarray]):
    figure, axes = drawing.sheet(height=4.0)
    axis = axes[0, 0]
    drawing.family(axis, time, [(name, angle / np.pi) for name, angle in angles.items()])
    for angle, colour in zip(angles.values(), drawing.shades(len(angles)), strict=True):
        if np.isnan(angle[-1]):
            last = np.nonzero(np.isfinite(angle))[0][-1]
            axis.plot(time[last], angle[last] / np.pi, "x", color=colour, ms=7)
    drawing.mark(axis, y=0.5)
    note = "x: the foot would have to be pulled down"
    drawing.name_panel(axis, "crank angle [π rad]", note, "time [s]")
    axis.set_xlim(0, DURATION)
    return figure
