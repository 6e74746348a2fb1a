"""The chapter's own scheme, forward differences in the crank angle and Euler in time, measured.

Figs. 13 and 17 again with fidelity Paper (eqs. 23-25) and integrator Euler (eqs. 27, 35, 36), at
several time steps and several D, beside the exact equations with located switching instants.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import NamedTuple

import numpy as np

from stickslip.dynamics.biped import BipedParams, BipedState, Euler, Paper, Trajectory, simulate
from stickslip.envs.rendering import theme
from stickslip.paper import drawing
from stickslip.paper.chart import DIFFERENCES, EULER, FRICTION, RATE
from stickslip.paper.result import NOT_STATED, Claim, Columns, Result, Setting
from stickslip.paper.slip_claims import QUARTER
from stickslip.paper.start import SCENE, TORQUE, first_step, torque_by_work
from stickslip.paper.walks import PERIODS, Walk, walk

COARSER = (16, 8, 4, 2, 1)
"""Time steps as multiples of the finest; PERIODS x samples of the finest make one step."""
STEPS_D = (0.1, 0.01)
"""The chapter's D beside DIFFERENCES.step, compared at the finest time step [rad]."""
HORIZON = 0.96
"""The start under 1 N m is followed for at least so long, past its first step [s]."""
BRACKET = 0.002
"""The least torque under the scheme is bracketed to this width [N m]."""


class Error(NamedTuple):
    """One setting of the scheme against the exact walk; NaN where it does not apply.

    angle: largest error of the crank angle during the first step [rad]. step_time: of the first
    step [s]. least_torque: that walks, minus the exact one [N m]. onset: of the slide at mid-step
    [T]. displacement: of the foot in the first step, forwards positive [m].
    """

    motion: str
    D: float
    dt: float
    angle: float = nan
    step_time: float = nan
    least_torque: float = nan
    onset: float = nan
    displacement: float = nan


@dataclass(frozen=True)
class Exact:
    """Reference of the errors."""

    start: Trajectory
    walk: Walk
    least_torque: float
    count: int


START, SLIP = "from rest, 1 N m", "3 rad/s, mu 0.05"


def scheme(setting: Setting) -> Result:
    """Errors of the chapter's scheme."""
    params = BipedParams.from_bars()
    setting.say("exact")
    exact = _exact(params, PERIODS * setting.samples)
    rows = []
    settings = [(DIFFERENCES, k) for k in COARSER] + [(Paper(step=D), 1) for D in STEPS_D]
    for paper, coarser in settings:
        setting.say(f"D {paper.step:g} rad, dt x {coarser}")
        rows += [_start(params, exact, paper, coarser), _slip(params, exact, paper, coarser)]
    in_time = [row for row in rows if DIFFERENCES.step == row.D]
    in_angle = [
        row for row in rows if row.dt == min(one.dt for one in rows if one.motion == row.motion)
    ]
    claims = [
        *_start_claims(in_time, in_angle, exact),
        *_slip_claims(in_time, in_angle, exact),
    ]
    columns = _columns(rows)
    return Result({"": columns}, lambda: _draw(in_time, in_angle), claims)


def _exact(params: BipedParams, count: int) -> Exact:
    start = simulate(params, SCENE, BipedState(), TORQUE, HORIZON, HORIZON / count)
    one = walk(params, RATE, FRICTION, samples=count, count=count)
    return Exact(start, one, torque_by_work(params, count // PERIODS)[0], count)


def _start(params: BipedParams, exact: Exact, paper: Paper, coarser: int) -> Error:
    """Fig. 13's motion."""
    dt = coarser * HORIZON / exact.count
    course = _euler(params, paper, BipedState(), TORQUE, exact.count, dt)
    true_time = first_step(exact.start)
    whole = int(true_time / dt)  # samples in the exact first step
    angles = np.asarray(course.states.crank_angle)[: whole + 1]
    true = np.asarray(exact.start.states.crank_angle)[::coarser][: whole + 1]
    return Error(
        START,
        paper.step,
        dt,
        angle=float(np.max(np.abs(angles - true))),
        step_time=first_step(course) - true_time,
        least_torque=_least_torque(params, paper, exact.count, dt) - exact.least_torque,
    )


def _slip(params: BipedParams, exact: Exact, paper: Paper, coarser: int) -> Error:
    """Fig. 17's motion; the crank's angle is given, so the foot's is the error."""
    per_step = exact.count // coarser
    found = walk(
        params,
        RATE,
        FRICTION,
        samples=per_step,
        count=exact.count,
        integrator=EULER,
        fidelity=paper,
    )
    dt = found.period / per_step
    moved = float(found.place[per_step] - exact.walk.place[exact.count])
    return Error(SLIP, paper.step, dt, onset=_onset(found) - _onset(exact.walk), displacement=moved)


def _onset(course: Walk) -> float:
    """When the first slide after the first quarter starts [T]; NaN if none does."""
    onsets = [slide.start for slide in course.starting_in(0) if slide.onset > QUARTER]
    return onsets[0] if onsets else nan


def _euler(
    params: BipedParams, paper: Paper, state: BipedState, torque: float, count: int, dt: float
):
    return simulate(
        params, SCENE, state, torque, count * dt, dt, fidelity=paper, integrator=Euler()
    )


def _least_torque(params: BipedParams, paper: Paper, count: int, dt: float) -> float:
    """The least torque that walks a first step under the scheme [N m], by bisection."""
    low, high = 0.0, 1.2
    while high - low > BRACKET:
        middle = (low + high) / 2
        walks = _walks(params, paper, middle, count, dt)
        low, high = (low, middle) if walks else (middle, high)
    return (low + high) / 2


def _walks(params: BipedParams, paper: Paper, torque: float, count: int, dt: float) -> bool:
    """True if the crank gets through the first step before it turns back."""
    state = BipedState()
    for _ in range(8):
        course = _euler(params, paper, state, torque, count, dt)
        if np.isfinite(first_step(course)):
            return True
        if np.min(np.asarray(course.states.crank_rate)) < 0:
            return False
        state = course.final
    return False


def _start_claims(in_time: list[Error], in_angle: list[Error], exact: Exact) -> list[Claim]:
    by_dt, by_D = _of(in_time, START), _of(in_angle, START)
    least = exact.least_torque
    return [
        Claim(
            "Fig. 13 by eqs. (23)-(27); neither D nor the time step is printed",
            "crank angle in the first step under 1 N m off by "
            + ", ".join(f"{row.angle:.4f} rad at {1e3 * row.dt:.3g} ms" for row in by_dt)
            + f" (D = {DIFFERENCES.step:g})",
            NOT_STATED,
            f"order {_order([r.dt for r in by_dt], [r.angle for r in by_dt]):.2f} in the time step",
        ),
        Claim(
            "(the same at several D)",
            ", ".join(f"{row.angle:.4f} rad at D = {row.D:g}" for row in by_D)
            + f" (time step {1e3 * by_D[0].dt:.3g} ms, whose own error the last one is)",
            NOT_STATED,
            "forward differences look half a D ahead in X' and y', a whole D in X'' and y''",
        ),
        Claim(
            "0.84 N m by this scheme",
            ", ".join(f"{least + row.least_torque:.3f} at {1e3 * row.dt:.3g} ms" for row in by_dt)
            + "; "
            + ", ".join(f"{least + row.least_torque:.3f} at D = {row.D:g}" for row in by_D)
            + f" N m; exact {least:.4f}",
            NOT_STATED,
            f"bracketed to {BRACKET:g} N m. Euler's steps gain or lose energy, and the biped needs "
            "every bit of it to get over the steepest phase",
        ),
    ]


def _slip_claims(in_time: list[Error], in_angle: list[Error], exact: Exact) -> list[Claim]:
    by_dt, by_D = _of(in_time, SLIP), _of(in_angle, SLIP)
    whole = exact.walk.place[exact.count]
    onset = _onset(exact.walk)
    return [
        Claim(
            "Fig. 17 by eqs. (32)-(36), μ = 0.05",
            f"displacement of the foot after the first step (exact {1e3 * whole:+.3f} mm) off by "
            + ", ".join(
                f"{1e3 * row.displacement:+.3f} mm at {1e3 * row.dt:.3g} ms" for row in by_dt
            )
            + f"; onset (exact {onset:.4f} T) by "
            + ", ".join(f"{row.onset:+.4f}" for row in by_dt)
            + " T",
            NOT_STATED,
            "the onset waits for the next time step; in it the displacement's error is of order "
            f"{_order([r.dt for r in by_dt], [r.displacement for r in by_dt]):.2f}",
        ),
        Claim(
            "(the same at several D)",
            ", ".join(
                f"{1e3 * row.displacement:+.3f} mm and {row.onset:+.4f} T at D = {row.D:g}"
                for row in by_D
            )
            + f" (time step {1e3 * by_D[0].dt:.3g} ms)",
            NOT_STATED,
            "f = P' w² at constant crank rate: P' from second differences is that of D further on, "
            "so slip starts D / π of a step early",
        ),
    ]


def _of(rows: list[Error], motion: str) -> list[Error]:
    """The rows of one motion, coarse settings first."""
    found = [row for row in rows if row.motion == motion]
    return sorted(found, key=lambda row: (-row.D, -row.dt))


def _order(sizes: list[float], errors: list[float]) -> float:
    """Slope of log |error| against log size by least squares [-]."""
    logs = np.log(np.abs(errors))
    return float(np.polyfit(np.log(sizes), logs, 1)[0])


def _columns(rows: list[Error]) -> Columns:
    names = {
        "motion": "motion",
        "D": "D [rad]",
        "dt": "dt [s]",
        "angle": "largest error of crank angle [rad]",
        "step_time": "error of the first step's time [s]",
        "least_torque": "error of the least torque [N m]",
        "onset": "error of the onset [T]",
        "displacement": "error of the displacement in the first step [m]",
    }
    return {title: [getattr(row, name) for row in rows] for name, title in names.items()}


def _draw(in_time: list[Error], in_angle: list[Error]):
    figure, axes = drawing.sheet(2, 2, height=2.8)
    panels: Mapping[str, tuple[str, float, str]] = {
        START: ("angle", 1.0, "crank angle, largest error [rad]"),
        SLIP: ("displacement", 1e3, "displacement in the first step, |error| [mm]"),
    }
    for row, (motion, (name, scale, label)) in enumerate(panels.items()):
        for axis, rows, by in ((axes[row, 0], in_time, "dt"), (axes[row, 1], in_angle, "D")):
            found = _of(rows, motion)
            sizes = np.array([getattr(one, by) for one in found])
            errors = scale * np.abs([getattr(one, name) for one in found])
            axis.loglog(sizes, errors, "o-", color=theme.MOTOR, lw=1.4, ms=5)
            first = errors[0] * sizes / sizes[0]
            axis.loglog(sizes, first, color=theme.MUTED, lw=0.9, ls=drawing.DASH)
            others = {one.D if by == "dt" else 1e3 * one.dt for one in found}
            fixed = (
                f"D = {max(others):g} rad" if by == "dt" else f"{motion}; dt = {max(others):.3g} ms"
            )
            below = "time step dt [s]" if by == "dt" else "D [rad]"
            drawing.name_panel(axis, label if by == "dt" else "", fixed, below)
    return figure
