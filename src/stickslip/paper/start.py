"""Figs. 13 and 14: from rest at pi/2, both feet on the floor, under a constant torque."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import (
    BipedParams,
    BipedState,
    Trajectory,
    inverse_dynamics,
    reduced_inertia,
    simulate,
)
from stickslip.dynamics.scene import Scene
from stickslip.dynamics.status import Status
from stickslip.paper import drawing
from stickslip.paper.result import (
    NOT_STATED,
    Claim,
    Columns,
    Result,
    Setting,
    by_calibration,
    by_construction,
)
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


def torques(setting: Setting) -> Result:
    """Fig. 13."""
    params = BipedParams.from_bars()
    courses = {}
    for torque in TORQUES:
        setting.say(f"{torque:g} N m")
        courses[torque] = from_rest(params, torque, DURATION, setting.samples)
    setting.say("least torque")
    least, steps = least_torque(params, setting.samples)
    by_work, place = torque_by_work(params, setting.samples)
    claims = [
        _least(least, steps, by_work, place),
        _peak(params, least, setting.samples),
        _ends(courses),
        _friction(params, courses[TORQUE]),
        Claim(
            "Working Model 2D gives similar curves (Fig. 13b)",
            "not repeated",
            NOT_STATED,
            "the program is not at hand; this package's full and reduced equations take its place",
        ),
    ]
    curves = {f"{torque:g} N m": course for torque, course in courses.items()}
    note = "x: the foot would have to be pulled down"
    return Result({"": _angles(curves)}, lambda: _draw(curves, note), claims)


def weights(setting: Setting) -> Result:
    """Fig. 14."""
    params = BipedParams.from_bars()
    own = float(params.total_mass)
    courses = {}
    for mass in WEIGHTS:
        setting.say(f"{mass:g} kg")
        courses[mass] = from_rest(denser(params, mass / own), TORQUE, DURATION, setting.samples)
    least, _ = torque_by_work(params, setting.samples)
    step = {mass: first_step(course) for mass, course in courses.items()}
    claims = [
        Claim(
            "1 N m and several weights: curves only",
            "first step in "
            + ", ".join(
                f"{time:.3f} s ({mass:g} kg)" for mass, time in step.items() if np.isfinite(time)
            ),
            NOT_STATED,
            "the chapter prints neither the weights nor a number",
        ),
        _heavier(step, own, least),
    ]
    curves = {f"{mass:g} kg": course for mass, course in courses.items()}
    note = f"{TORQUE:g} N m; x: the foot would have to be pulled down"
    return Result({"": _angles(curves)}, lambda: _draw(curves, note), claims)


def denser(params: BipedParams, factor: float) -> BipedParams:
    """The robot with all densities, so masses and moments of inertia, times `factor`."""
    return replace(params, mass=params.mass * factor, inertia=params.inertia * factor)


def from_rest(params: BipedParams, torque: float, duration: float, samples: int) -> Trajectory:
    """A constant torque [N m] for `duration` [s] in 4 x samples steps, from rest at pi/2, no slip.

    As in the chapter, nothing looks at whether the biped topples.
    """
    count = 4 * samples
    return simulate(params, SCENE, BipedState(), torque, duration, duration / count)


def first_step(course: Trajectory) -> float:
    """When the first step ends [s], interpolated between samples; infinite if it does not."""
    angle, time = np.asarray(course.states.crank_angle), np.asarray(course.states.time)
    past = np.nonzero(angle >= 3 * np.pi / 2)[0]
    if len(past) == 0:
        return float("inf")
    i = int(past[0])
    share = (3 * np.pi / 2 - angle[i - 1]) / (angle[i] - angle[i - 1])
    return float(time[i - 1] + share * (time[i] - time[i - 1]))


def least_torque(
    params: BipedParams, samples: int, tolerance: float = TOLERANCE
) -> tuple[float, int]:
    """The torque from which on the first step is walked to its end [N m], by bisection between 0
    and 2 N m; and how many walks that took."""
    low, high, count = 0.0, 2.0, 0
    while high - low > tolerance:
        middle, count = (low + high) / 2, count + 1
        walks = np.isfinite(first_step(from_rest(params, middle, PATIENCE, samples)))
        low, high = (low, middle) if walks else (middle, high)
    return high, count


def torque_by_work(params: BipedParams, samples: int) -> tuple[float, float]:
    """The least torque [N m] and the phase where it nearly stops [T], by the balance of work.

    From rest, M w^2 / 2 = T (theta - pi/2) - (V(theta) - V(pi/2)): the crank gets past every phase
    if T is above the greatest mean slope of V. MODEL 1.4, with V' = g Y the torque at rest.
    """
    slope = np.asarray(steady(params, phases(samples), 0.0).torque)
    bend = np.gradient(slope, edge_order=2)
    rise = np.cumsum((slope[1:] + slope[:-1]) / 2) - (bend[1:] - bend[0]) / 12  # Euler-Maclaurin
    mean = rise / np.arange(1, samples + 1)
    place, least = peak_of(mean)
    return least, (1 + place * (samples - 1)) / samples


def _least(least: float, walks: int, by_work: float, place: float) -> Claim:
    """least: by bisection in so many walks; by_work: at the place [T]; both [N m]."""
    apart = abs(least - by_work)
    return Claim(
        f"the least torque that makes it walk is {STATED_TORQUE:g} N m",
        f"{least:.4f} N m by bisection in {walks} walks of {PATIENCE:g} s, {by_work:.4f} N m "
        f"by the work done up to the phase {place:.3f} T where it nearly stops",
        by_calibration(round(least, 2) == STATED_TORQUE and apart < TOLERANCE),
        "the hip's mass and the bars' density were chosen for this number; that the two methods "
        f"are less than {TOLERANCE:g} N m apart checks the computation",
    )


def _heavier(step: dict[float, float], own: float, least: float) -> Claim:
    """step: when the first step ends, by mass, rising [s]. own: the robot's mass [kg]. least: the
    torque that it needs by the balance of work [N m]."""
    heaviest = own * TORQUE / least
    does = [mass for mass, time in step.items() if np.isfinite(time)]
    times = [step[mass] for mass in does]
    expected = does == [mass for mass in step if mass < heaviest]
    return Claim(
        "(read as: heavier is slower, and too heavy does not walk)",
        f"walks up to {heaviest:.2f} kg = {own:.2f} kg x {TORQUE:g} N m / {least:.4f} N m; of the "
        f"drawn ones up to {max(does, default=0):g} kg",
        by_construction(expected and np.all(np.diff(times) > 0)),
        "with all densities scaled alike, M, P and Y scale, so for any robot only torque per "
        "weight counts, and less of it is slower. That the walks drawn stop where the balance of "
        "work says checks the computation",
    )


def _peak(params: BipedParams, least: float, samples: int) -> Claim:
    still = np.asarray(steady(params, phases(samples), 0.0).torque)
    _, peak = peak_of(still)
    return Claim(
        "(Figs. 11 and 13 together)",
        f"holding still at the steepest phase takes {peak:.2f} N m, starting to walk {least:.2f}; "
        f"holding still at pi/2 takes {still[0]:.2f} N m",
        NOT_STATED,
        "where holding still takes a negative torque, at pi/2, the weight drives the crank by "
        "itself, and that momentum carries it over the steepest phase",
    )


def _ends(courses: dict[float, Trajectory]) -> Claim:
    ended = {
        torque: (float(course.final.time), float(jnp.max(jnp.abs(course.states.crank_rate))))
        for torque, course in courses.items()
        if int(course.status) == Status.LIFT_OFF
    }
    shown = ", ".join(f"{t:.2f} s, {w:.1f} rad/s ({torque:g})" for torque, (t, w) in ended.items())
    return Claim(
        "(how the curves go on)",
        "the foot lifts off after (time, fastest crank rate so far, torque in N m): "
        + (shown or f"never within {DURATION:g} s"),
        NOT_STATED,
        "a constant torque above the least one speeds up step by step, and within a step the crank "
        "rate swings as M changes, until the ground would have to pull: there the model ends",
    )


def _friction(params: BipedParams, course: Trajectory) -> Claim:
    before = np.asarray(course.states.steps)[1:] == 0
    phase, rate = (
        np.asarray(x)[1:][before] for x in (course.states.phase, course.states.crank_rate)
    )
    zmp, use = (np.asarray(x) for x in _loads(params, phase, rate, TORQUE))
    foot = float(params.crank)
    return Claim(
        f"(the floor under {TORQUE:g} N m)",
        f"first step: |f| / N up to {use.max():.3f}, zero-moment point from "
        f"{zmp.min() / foot:.1f} to {zmp.max() / foot:.1f} crank lengths from the ankle",
        NOT_STATED,
        "Fig. 13 assumes a foot that neither slips nor tips. The default foot reaches 8 crank "
        "lengths each way",
    )


@jax.jit
def _loads(
    params: BipedParams, phase: jax.Array, rate: jax.Array, torque: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Zero-moment points [m] and |f| / N of a walk without slip under one torque."""

    def at(angle: jax.Array, w: jax.Array) -> tuple[jax.Array, jax.Array]:
        inertia = reduced_inertia(params, angle)
        alpha = (torque - inertia.dM * w**2 / 2 - params.gravity * inertia.Y) / inertia.M
        needs = inverse_dynamics(params, angle, w, alpha)
        return needs.zmp, jnp.abs(needs.friction_force / needs.normal_force)

    return jax.vmap(at)(phase, rate)


def _angles(curves: dict[str, Trajectory]) -> Columns:
    columns: dict[str, np.ndarray] = {}
    for name, course in curves.items():
        columns.setdefault("time [s]", DURATION * np.linspace(0, 1, len(course.states.time)))
        columns[f"crank angle, {name} [rad]"] = _alive(course)
    return columns


def _alive(course: Trajectory) -> np.ndarray:
    """The crank's angle, NaN after the walk has left the model."""
    angle = np.array(course.states.crank_angle)
    angle[1:][np.asarray(course.contacts.status) > Status.SLIP_ONSET] = np.nan
    return angle


def _draw(curves: dict[str, Trajectory], note: str):
    figure, axes = drawing.sheet(height=4.0)
    axis = axes[0, 0]
    time = DURATION * np.linspace(0, 1, len(next(iter(curves.values())).states.time))
    angles = {name: _alive(course) / np.pi for name, course in curves.items()}
    drawing.family(axis, time, angles.items())
    for angle, colour in zip(angles.values(), drawing.shades(len(angles)), strict=True):
        if np.isnan(angle[-1]):
            last = np.nonzero(np.isfinite(angle))[0][-1]
            axis.plot(time[last], angle[last], "x", color=colour, ms=7)
    drawing.mark(axis, y=0.5)
    drawing.name_panel(axis, "crank angle [π rad]", note, "time [s]")
    axis.set_xlim(0, DURATION)
    return figure
