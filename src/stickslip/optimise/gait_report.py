"""A solved gait problem in words, as a table of nodes and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from stickslip.optim.gait.problem import RESIDUAL_UNITS
from stickslip.records.table import Table

if TYPE_CHECKING:
    from stickslip.optim import Gait, GaitProblem, GaitResult, Replay

UNLOADED = 1e-3
"""Share of the weight below which the ground counts as carrying nothing."""


def gait_rows(
    problem: GaitProblem, result: GaitResult, replays: Mapping[str, Replay]
) -> list[tuple[str, str]]:
    """Rows of the printed report: a name and its value."""
    unit = "" if problem.goal.unit in ("-", "weighted") else f" {problem.goal.unit}"
    walk = "one periodic step" if problem.is_periodic else f"{problem.steps_taken} steps"
    found = [
        ("objective", problem.goal.words),
        ("walk", f"{walk}, {problem.cells} cells each"),
        ("status", result.status_in_words),
        ("message", result.message),
    ]
    if result.gait is None:
        return [*found, ("value", "no gait found"), ("time", f"{result.seconds:.3g} s")]
    worst = {name: by for name, by in result.residuals.items() if by > 1e-12}
    violated = ", ".join(f"{name} {by:.2g} {RESIDUAL_UNITS[name]}" for name, by in worst.items())
    return [
        *found,
        ("value", f"{result.value:.8g}{unit}, limits kept at the nodes of this grid"),
        ("lower bound", f"{_number(result.lower_bound, unit)}, of gaits of this grid"),
        ("of all gaits", f"{_number(result.every_bound, unit)} or more"),
        ("between nodes, too", _number(result.held_value, unit)),
        ("violated", violated or "nothing"),
        *_of_gait(problem, result.best),
        *((f"replay, {name}", _replayed(one)) for name, one in replays.items()),
        ("time", f"{result.seconds:.3g} s, {result.evaluations} programs solved"),
    ]


def presses(gait: Gait) -> np.ndarray:
    """Mask of nodes where the normal force exceeds a share UNLOADED of the weight: elsewhere a
    friction use or a zero-moment point is a quotient of nothing."""
    return gait.normal_force > UNLOADED * gait.nodes.robot.weight


def _of_gait(problem: GaitProblem, gait: Gait) -> list[tuple[str, str]]:
    """The gait's own numbers."""
    robot, spent = gait.nodes.robot, gait.spent
    of = "a step" if gait.grid.steps == 1 else f"of all {gait.grid.steps} steps"
    speed = gait.mean_rate / np.pi * robot.step_length
    transport = gait.cost_of_transport(problem.copper_loss)
    return [
        ("mean crank rate", f"{gait.mean_rate:.6g} rad/s, {speed:.4g} m/s"),
        ("crank rate", f"{_range(gait.crank_rate)} rad/s"),
        ("torque", f"{_range(gait.torque)} N m"),
        ("friction used", f"{gait.friction_use:.5g} of the normal force at most"),
        ("normal force", f"{_range(gait.normal_force)} N"),
        ("zero-moment point", f"{_range(gait.zmp[presses(gait)])} m"),
        ("positive work", f"{spent['work']:.6g} J {of}"),
        ("copper", f"{problem.copper_loss * spent['torque']:.6g} J {of}"),
        ("cost of transport", f"{transport:.5g}, copper included"),
    ]


def _range(values: np.ndarray) -> str:
    return f"{np.min(values):.4g} to {np.max(values):.4g}"


def _number(value: float | None, unit: str) -> str:
    return "none" if value is None or not np.isfinite(value) else f"{value:.8g}{unit}"


def _replayed(one: Replay) -> str:
    floor = "foot held" if one.mu is None else f"mu {one.mu:g}"
    slid = "no slip" if one.kept else f"slid {one.slid:.2g} m, {one.status.name}"
    return (
        f"{floor}: {slid}; {one.mean_rate:.6g} rad/s (promised {one.promised_mean_rate:.6g}), "
        f"{one.work:.6g} J to exchange {one.steps} (promised {one.promised_work:.6g} in all), "
        f"friction used {one.friction_use:.4g}"
    )


def gait_csv(problem: GaitProblem, result: GaitResult) -> str:
    """A line a node, numbers in SI units and radians."""
    gait = result.best
    steps = np.repeat(np.arange(gait.grid.steps), gait.grid.cells + 1)
    rate = gait.crank_rate
    columns = {
        "step": steps,
        "crank angle [rad]": gait.theta.ravel(),
        "time [s]": gait.clock.ravel(),
        "crank rate [rad/s]": rate.ravel(),
        "crank acceleration [rad/s^2]": gait.a.ravel(),
        "torque [N m]": gait.torque.ravel(),
        "friction force [N]": gait.friction_force.ravel(),
        "normal force [N]": gait.normal_force.ravel(),
        "zero-moment point [m]": gait.zmp.ravel(),
    }
    return Table.of_columns(columns).csv()


GAIT_UNITS = {
    "residuals": RESIDUAL_UNITS,
    "seconds": "s",
    "mean_rate": "rad/s",
    "friction_use": "-",
    "cost_of_transport": "-",
    "theta": "rad",
    "crank_rate": "rad/s",
    "torque": "N m",
    "replays": {
        "slid": "m",
        "duration": "s",
        "work": "J",
        "mean_rate": "rad/s",
        "rate_error": "rad/s",
        "end_rate": "rad/s",
    },
}
"""Of the result's numbers in `gait_content`; its value and bounds have a unit beside them."""


STATED = ("status", "message", "value", "lower_bound", "every_bound", "held_value")
STATED += ("feasible", "residuals", "seconds", "evaluations")
OF_GAIT = ("mean_rate", "friction_use", "spent", "theta", "crank_rate", "torque")
"""Of a result and of its gait, as result.json holds them."""


def gait_content(
    problem: GaitProblem,
    result: GaitResult,
    replays: Mapping[str, Replay],
    asked: Mapping[str, object],
) -> dict[str, object]:
    """Everything: what was asked for, the robot's numbers, the result."""
    found: dict[str, object] = {name: getattr(result, name) for name in STATED}
    found["unit"] = problem.goal.unit
    if result.certificate is not None:
        found["certificate"] = result.certificate
    if result.gait is not None:
        gait = result.best
        found |= {name: getattr(gait, name) for name in OF_GAIT}
        found["cost_of_transport"] = gait.cost_of_transport(problem.copper_loss)
        found["replays"] = {name: asdict(one) | {"kept": one.kept} for name, one in replays.items()}
    return {"asked": dict(asked), "robot": problem.params, "result": found}
