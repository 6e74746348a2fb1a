"""`stickslip optimise biped`: find the best gait, replay it, print and write what came out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import shown
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.extras import require
from stickslip.optim import GaitProblem, GaitResult, Replay, replay, solve
from stickslip.optim.gait.problem import RESIDUAL_UNITS
from stickslip.optim.problem import require_scalar
from stickslip.optimise.flags import GaitOptions
from stickslip.optimise.machine import finite, motor_of, own_files, robot_of
from stickslip.optimise.shared import finished, require_folder
from stickslip.parser import options_of
from stickslip.records.table import Content, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from stickslip.optim import Gait

NODES, PICTURE = "gait.csv", "gait.png"
TORQUE_LIMIT = 4.0
"""Of the motor, unless something else is said [N m]."""
WALKED = 3
"""Steps that a periodic gait is replayed for."""
FILES = ("out", "overwrite", "pictures")
NOT_WALKED = (
    "no replay walks this gait, on the edge of what the model covers; the settings min_normal, "
    "zmp and reserve keep away from it"
)
VALUES = ("value", "lower_bound", "every_bound", "held_value")


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Find a gait, replay it, print and write it; NOTHING_FOUND without one.

    Writes DIR/gait.csv, result.json and gait.png, each under a temporary name first; without a gait
    only result.json. Wrong input is refused before anything is computed or written.
    """
    given = options_of(GaitOptions, flags)
    problem = gait_problem_of(given)
    default = f"runs/biped-{given.objective.replace('=', '').replace(',', '-')}"
    out = require_folder(given.out or default, given.overwrite)
    require_scalar("feedback", given.feedback, low=0.0, accepted="a finite number >= 0 [1/rad]")
    if given.pictures:
        require("matplotlib.figure")
    result = solve(problem, progress=True)
    replays = _replays(problem, result, given)
    lost = bool(replays) and all(one.status > Status.SLIP_ONSET for one in replays.values())
    asked = {name: value for name, value in asdict(given).items() if name not in FILES}
    asked |= {name: getattr(problem, name) for name in ("torque_limit", "copper_loss")}
    found = gait_content(problem, result, replays, asked)
    units = {"result": GAIT_UNITS | dict.fromkeys(VALUES, problem.goal.unit)}
    tables, picture = own_files(given, problem.params), None
    if result.gait is not None:
        tables[NODES] = gait_csv(result)
        picture = PICTURE, lambda: _picture(problem, result)
    lines, said = gait_rows(problem, result, replays), [NOT_WALKED] * lost
    return finished(
        out, given, lines, said, found, units, tables, (NODES, PICTURE, "robot.toml"), picture
    )


def _picture(problem: GaitProblem, result: GaitResult) -> tuple[Figure, str]:
    from stickslip.optimise.picture import draw_gait

    title = f"least {problem.goal.words}: {result.value:.5g}{_unit(problem)}"
    return draw_gait(problem, result), title


def _unit(problem: GaitProblem) -> str:
    """The value's unit behind a number."""
    return "" if problem.goal.unit in ("-", "weighted") else f" {problem.goal.unit}"


def gait_problem_of(given: GaitOptions) -> GaitProblem:
    """The problem that the flags describe."""
    share = "a share from 0 to below 1"
    require_scalar("reserve", given.reserve, low=0.0, high=0.999, accepted=share)
    robot, motor = robot_of(given), motor_of(given)
    robot = robot.replace(payload=float(robot.payload) + given.payload)
    mu: list[float] | float | None = None
    if given.mu is not None:
        left = [one * (1 - given.reserve) for one in given.mu]
        mu = left[0] if len(left) == 1 else left
    objective = _objective(given.objective)
    names = ("mean_rate", "min_normal", "zmp")
    limits: dict[str, Any] = {name: getattr(given, name) for name in names}
    limits |= {"mu": mu, "steps": given.cells, "torque_limit": TORQUE_LIMIT} | motor
    if given.torque_limit is not None:
        limits["torque_limit"] = finite(given.torque_limit)
    if given.copper_loss is not None:
        limits["copper_loss"] = given.copper_loss
    if given.steps is not None:
        start = 0.0 if given.start is None else given.start
        ends = {"start_rate": start, "end_rate": given.end}
        return GaitProblem.transfer(robot, given.steps, objective, **ends, **limits)
    for name, value in (("start", given.start), ("end", given.end)):
        if value is not None:
            raise ValueError(f"{name} without --steps; accepted: with a walk of --steps N")
    if isinstance(mu, list):
        raise ValueError(f"mu has shape ({len(mu)},); accepted: one number without --steps")
    return GaitProblem.periodic(robot, objective, **limits)


def _objective(text: str) -> str | dict[str, float]:
    """A name, or names and weights: time=1,energy=0.2."""
    if "=" not in text:
        return text
    try:
        pairs = (part.split("=") for part in text.split(","))
        return {name.strip(): float(weight) for name, weight in pairs}
    except ValueError:
        accepted = "a name, or name=weight with commas between"
        raise ValueError(f"--objective {shown(text)}; accepted: {accepted}") from None


def _replays(problem: GaitProblem, result: GaitResult, given: GaitOptions) -> dict[str, Replay]:
    """The gait walked open loop and with feedback, on a floor of the friction asked for; of several
    frictions the foot is held, and the replay says how much it used."""
    if result.gait is None or not result.best.duration < float("inf"):
        return {}
    mu = given.mu[0] if given.mu is not None and len(set(given.mu)) == 1 else None
    steps = WALKED if problem.is_periodic else None
    kinds = {"open loop": 0.0, f"feedback {given.feedback:g}/rad": float(given.feedback)}
    return {
        name: replay(
            problem.params, result.best, mu=mu, feedback=gain, walk_steps=steps, zmp=problem.zmp
        )
        for name, gain in kinds.items()
    }


def gait_rows(
    problem: GaitProblem, result: GaitResult, replays: Mapping[str, Replay]
) -> list[tuple[str, str]]:
    """Rows of the printed report: a name and its value."""
    unit = _unit(problem)
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
        ("zero-moment point", f"{_range(gait.zmp[gait.loaded])} m"),
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


def gait_csv(result: GaitResult) -> str:
    """A line a node, numbers in SI units and radians."""
    gait = result.best
    columns = {
        "step": np.repeat(np.arange(gait.grid.steps), gait.grid.cells + 1),
        "crank angle [rad]": gait.theta,
        "time [s]": gait.clock,
        "crank rate [rad/s]": gait.crank_rate,
        "crank acceleration [rad/s^2]": gait.a,
        "torque [N m]": gait.torque,
        "friction force [N]": gait.friction_force,
        "normal force [N]": gait.normal_force,
        "zero-moment point [m]": gait.zmp,
    }
    return Table.of_columns({name: of.ravel() for name, of in columns.items()}).csv()


GAIT_UNITS: dict[str, Any] = {
    "residuals": RESIDUAL_UNITS,
    "seconds": "s",
    "mean_rate": "rad/s",
    "friction_use": "-",
    "cost_of_transport": "-",
    "theta": "rad",
    "crank_rate": "rad/s",
    "torque": "N m",
    "replays": {"slid": "m", "duration": "s", "work": "J"}
    | dict.fromkeys(("mean_rate", "rate_error", "end_rate"), "rad/s"),
}
"""Units of the numbers in `gait_content`; its value and bounds have a unit beside them."""


STATED = ("status", "message", "value", "lower_bound", "every_bound", "held_value")
STATED += ("feasible", "residuals", "seconds", "evaluations")
OF_GAIT = ("mean_rate", "friction_use", "spent", "theta", "crank_rate", "torque")
"""Entries of a result and of its gait in result.json."""


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
