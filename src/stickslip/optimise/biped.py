"""`stickslip optimise biped`: find the best gait, or a walk whose foot may slip, and replay it."""

from argparse import Namespace
from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import robot_text
from stickslip.dynamics.checks import shown
from stickslip.envs.rendering.sheet import png
from stickslip.optim import (
    Gait,
    GaitProblem,
    GaitResult,
    Replay,
    SlipTransfer,
    best_transfer,
    replay,
    slip_transfer,
)
from stickslip.optim.gait.footing import Footing
from stickslip.optim.gait.problem import RESIDUAL_UNITS
from stickslip.optim.problem import require_scalar
from stickslip.optimise.picture import draw_gait, draw_slip
from stickslip.parser import finite
from stickslip.records.table import Column, Content, Table, with_unit
from stickslip.report import one_row, result_folder, write_result

Answer: TypeAlias = tuple[bool, dict[str, Table], dict[str, object], dict[str, Any]]
"""Whether something was found, tables, entries of the result, and files by name."""
NODES, PICTURE, ROBOT = "gait.csv", "gait.png", "robot.toml"
WALK, WALK_PICTURE = "walk.csv", "walk.png"
TORQUE_LIMIT = 4.0
"""Of the motor, unless something else is said [N m]."""
MOTOR = ("torque_limit", "copper_loss", "max_power", "efficiency")
WALKED = 3
"""Steps that a periodic gait is replayed for."""
VALUES = ("value", "lower_bound", "every_bound", "held_value")


def optimise_command(flags: Mapping[str, Any]) -> Content:
    """Find a gait, or a walk whose foot may slip, replay it, print and write it; without one
    NOTHING_FOUND and result.json."""
    given = Namespace(**flags)
    problem = gait_problem_of(given)
    default = f"runs/biped-{given.objective.replace('=', '').replace(',', '-')}"
    out = result_folder(given, default)
    require_scalar("feedback", given.feedback, low=0.0, accepted="a finite number >= 0 [1/rad]")
    if given.mark is not None and given.most_steps is not None:
        raise ValueError("most_steps with mark, which tells the steps; accepted: one of them")
    most = problem.steps_taken if given.most_steps is None else given.most_steps
    find = find_gait if given.mu_kinetic is None else find_walk
    found, tables, result, files = find(problem, most, given)
    limits = {name: getattr(problem, name) for name in MOTOR}
    if given.robot is not None or given.changes:
        motor = {name: value for name, value in limits.items() if value is not None}
        files[ROBOT] = lambda: robot_text(vars(problem.params), motor)
    facts = {"asked": vars(given) | limits, "robot": problem.params, "result": result}
    usual = NODES, PICTURE, WALK, WALK_PICTURE, ROBOT
    return write_result(given, out, tables, facts, files, usual, found)


def find_gait(problem: GaitProblem, most: int, given: Namespace) -> Answer:
    """The best gait of problem.steps_taken to `most` steps, and its replays."""
    problem, result = best_transfer(problem, most, progress=True)
    replays, tables = _replays(problem, result, given), {"summary": gait_summary(problem, result)}
    content, files = gait_content(problem, result, replays), dict[str, Any]()
    if result.gait is not None:
        tables["replays"] = replay_table(replays)
        files[NODES] = gait_table(result.best).csv
        goal = problem.goal
        title = f"Least {goal.words}: {with_unit(result.value, goal.column_unit, 4)}"
        files[PICTURE] = lambda: png(draw_gait(problem, result), title)
    return result.gait is not None and result.feasible, tables, content, files


def gait_problem_of(given: Namespace) -> GaitProblem:
    """The problem that the flags describe."""
    share = "a share from 0 to below 1"
    reserve = given.reserve or 0.0
    require_scalar("reserve", reserve, low=0.0, high=0.999, accepted=share)
    robot, motor = BipedParams.with_motor(given.robot, given.changes)
    robot = robot.replace(payload=float(robot.payload) + given.payload)
    mu: list[float] | float | None = None
    if given.mu is not None:
        left = [one * (1 - reserve) if given.mu_kinetic is None else one for one in given.mu]
        mu = left[0] if len(left) == 1 else left
    objective = _objective(given.objective)
    names = ("mean_rate", "min_normal", "zmp", "max_torque_rate")
    limits: dict[str, Any] = {name: getattr(given, name) for name in names}
    limits |= {"mu": mu, "steps": given.cells, "torque_limit": TORQUE_LIMIT} | motor
    if given.torque_limit is not None:
        limits["torque_limit"] = finite(given.torque_limit)
    if given.copper_loss is not None:
        limits["copper_loss"] = given.copper_loss
    if given.steps is not None or given.mark is not None:
        start = 0.0 if given.start is None else given.start
        ends = {"start_rate": start, "end_rate": given.end, "distance": given.mark}
        return GaitProblem.transfer(robot, given.steps, objective, **ends, **limits)
    for name in ("start", "end", "most_steps"):
        if getattr(given, name) is not None:
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


def _replays(problem: GaitProblem, result: GaitResult, given: Namespace) -> dict[str, Replay]:
    """The gait walked open loop and with feedback, on a floor of the friction asked for; of several
    frictions the foot is held, and the replay says how much it used."""
    if result.gait is None or not result.best.duration < float("inf"):
        return {}
    mu = given.mu[0] if given.mu is not None and len(set(given.mu)) == 1 else None
    steps = WALKED if problem.is_periodic else None
    kinds = {"open loop": 0.0, f"feedback {given.feedback:g}/rad": float(given.feedback)}
    how: dict[str, Any] = {"mu": mu, "walk_steps": steps, "zmp": problem.zmp}
    walk = partial(replay, problem.params, result.best, **how)
    return {name: walk(feedback=gain) for name, gain in kinds.items()}


def gait_summary(problem: GaitProblem, result: GaitResult) -> Table:
    """One row: value, bounds, and the gait's own numbers. held_value: with limits kept between the
    nodes, too; every_bound: no gait of any grid is better."""
    unit = problem.goal.column_unit
    found: dict[Column, object] = {
        Column("objective", words=True): problem.goal.words,
        Column("status", words=True): result.status_in_words,
        Column("message", words=True): result.message,
        Column("search_time", "s"): float(result.seconds),
    }
    if result.gait is None:
        return one_row(found)
    violated = {name: by for name, by in result.residuals.items() if by > 1e-12}
    for name in VALUES:
        found[Column(name, unit)] = getattr(result, name)
    found[Column("violated", words=True)] = ", ".join(
        f"{name} {by:.2g} {RESIDUAL_UNITS[name]}" for name, by in violated.items()
    )
    return one_row(found | _of_gait(problem, result.best))


def _of_gait(problem: GaitProblem, gait: Gait) -> dict[Column, object]:
    """The gait's own numbers."""
    spent, need, eta = gait.spent, None, problem.efficiency
    rate = None if problem.max_torque_rate is None else gait.torque_rate_on_grid
    if problem.goal.is_friction:
        need = Footing(gait.profiles).at_rate(gait.mean_rate).friction
    return {
        Column("mean_crank_rate", "rad/s"): float(gait.mean_rate),
        Column("mean_speed", "m/s"): float(gait.distance / gait.duration),
        Column("steps"): None if problem.is_periodic else gait.grid.steps,
        Column("least_crank_rate", "rad/s"): float(np.min(gait.crank_rate)),
        Column("largest_torque", "N m"): float(np.max(np.abs(gait.torque))),
        Column("torque_rate_on_grid", "N m/s"): rate,
        Column("friction_used"): float(gait.friction_use),
        Column("constant_rate_needs"): need,
        Column("least_normal_force", "N"): float(np.min(gait.normal_force)),
        Column("positive_work", "J"): float(spent["work"]),
        Column("copper", "J"): float(problem.copper_loss * spent["torque"]),
        Column("drive_loss", "J"): float(lost) if (lost := spent["work"] * (1 / eta - 1)) else None,
        Column("largest_power", "W"): gait.largest_power,
        Column("cost_of_transport"): float(gait.cost_of_transport(problem.copper_loss, eta)),
    }


def replay_table(replays: Mapping[str, Replay]) -> Table:
    """A row a replay."""
    numbers = {"slid": "m", "steps": "-", "mean_rate": "rad/s", "work": "J", "friction_use": "-"}
    shown = {name: [getattr(one, of) for of in numbers] for name, one in replays.items()}
    rows = [[name, one.mu, one.status.name, *shown[name]] for name, one in replays.items()]
    heads = [Column("replay", words=True), Column("mu"), Column("status", words=True)]
    return Table([*heads, *(Column(name, unit) for name, unit in numbers.items())], rows)


def gait_table(gait: Gait) -> Table:
    """A row a node, numbers in SI units and radians."""
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
    return Table.of_columns({name: of.ravel() for name, of in columns.items()})


STATED = ("status", "message", *VALUES, "feasible", "residuals", "seconds", "evaluations")
OF_GAIT = ("mean_rate", "friction_use", "spent", "theta", "crank_rate", "torque")
"""Entries of a result and of its gait in result.json."""


def gait_content(
    problem: GaitProblem, result: GaitResult, replays: Mapping[str, Replay]
) -> dict[str, object]:
    """The result."""
    found: dict[str, object] = {name: getattr(result, name) for name in STATED}
    found["unit"] = problem.goal.unit
    if result.certificate is not None:
        found["certificate"] = result.certificate
    if result.gait is not None:
        gait = result.best
        found |= {name: getattr(gait, name) for name in OF_GAIT}
        found["cost_of_transport"] = gait.cost_of_transport(problem.copper_loss, problem.efficiency)
        found["replays"] = {name: asdict(one) | {"kept": one.kept} for name, one in replays.items()}
    return found


WALK_STATED = ("value", "lower_bound", "feasible", "reserve", "duration", "slid", "distance")
WALK_ARRAYS = ("theta", "clock", "crank_rate", "foot_velocity", "torque")


def find_walk(problem: GaitProblem, most: int, given: Namespace) -> Answer:
    """The best walk of problem.steps_taken to `most` steps, and its replay."""
    options: dict[str, Any] = {"mu_kinetic": given.mu_kinetic, "feedback": given.feedback}
    options |= {"reserve": given.reserve, "progress": True}
    problem, found = best_transfer(problem, most, slip_transfer, **options)
    tables = {"summary": walk_summary(problem, found)}
    facts: dict[str, object] = {name: getattr(found, name) for name in WALK_STATED + WALK_ARRAYS}
    files: dict[str, Any] = {}
    if found.feasible:
        facts |= {"replay": asdict(found.replay), "arrives": found.arrives}
        files[WALK] = walk_table(found).csv
        title = f"Least {problem.goal.words} where the foot may slip: {found.value:.4g}"
        files[WALK_PICTURE] = lambda: png(draw_slip(found), title)
    return found.feasible and found.arrives, tables, facts, files


def walk_summary(problem: GaitProblem, found: SlipTransfer) -> Table:
    """One row: the walk as planned, and as its replay ends."""
    unit = problem.goal.column_unit
    rows: dict[Column, object] = {
        Column("objective", words=True): problem.goal.words,
        Column("feasible", words=True): "yes" if found.feasible else "no walk found",
        Column("value", unit): found.value,
        Column("lower_bound", unit): found.lower_bound,
        Column("steps"): problem.steps_taken,
    }
    if (walked := found.replay) is not None:
        rows |= {
            Column("duration", "s"): found.duration,
            Column("slid", "m"): found.slid,
            Column("distance", "m"): found.distance,
            Column("reserve"): found.reserve,
            Column("replay_arrives", words=True): "yes" if found.arrives else "no",
            Column("replay_duration", "s"): walked.duration,
            Column("replay_slid", "m"): walked.slid,
            Column("replay_end_rate", "rad/s"): walked.end_rate,
            Column("replay_end_velocity", "m/s"): walked.end_velocity,
        }
    return one_row(rows)


def walk_table(found: SlipTransfer) -> Table:
    """A row for each end of a piece, numbers in SI units and radians; torque: of the next piece."""
    n, count = found.theta.shape
    last = np.full((n, 1), np.nan)
    columns = {
        "step": np.repeat(np.arange(n), count).reshape(n, count),
        "crank angle [rad]": found.theta,
        "time [s]": found.clock,
        "crank rate [rad/s]": found.crank_rate,
        "foot velocity [m/s]": found.foot_velocity,
        "torque [N m]": np.concatenate([found.torque, last], axis=1),
    }
    return Table.of_columns({name: of.ravel() for name, of in columns.items()})
