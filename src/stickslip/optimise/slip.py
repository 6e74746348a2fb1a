"""`stickslip optimise biped --mu-kinetic`: a walk whose foot may slip, its replay, the files."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict
from typing import Any, TypeAlias

import numpy as np

from stickslip.envs.rendering.sheet import png
from stickslip.optim import GaitProblem, SlipTransfer, best_transfer, slip_transfer
from stickslip.optimise.picture import draw_slip
from stickslip.records.table import Column, Table
from stickslip.report import one_row

Answer: TypeAlias = tuple[bool, dict[str, Table], dict[str, object], dict[str, Any]]
"""Whether something was found, tables, entries of the result, and files by name."""
WALK, WALK_PICTURE = "walk.csv", "walk.png"
STATED = ("value", "lower_bound", "feasible", "reserve", "duration", "slid", "distance")
ARRAYS = ("theta", "clock", "crank_rate", "foot_velocity", "torque")


def find_walk(problem: GaitProblem, most: int, given: Namespace) -> Answer:
    """The best walk of problem.steps_taken to `most` steps, and its replay."""
    options: dict[str, Any] = {"mu_kinetic": given.mu_kinetic, "feedback": given.feedback}
    options |= {"reserve": given.reserve or None, "progress": True}
    problem, found = best_transfer(problem, most, slip_transfer, **options)
    tables = {"summary": summary(problem, found)}
    facts: dict[str, object] = {name: getattr(found, name) for name in STATED + ARRAYS}
    files: dict[str, Any] = {}
    if found.feasible:
        facts |= {"replay": asdict(found.replay), "arrives": found.arrives}
        files[WALK] = walk_table(found).csv
        title = f"Least {problem.goal.words} where the foot may slip: {found.value:.4g}"
        files[WALK_PICTURE] = lambda: png(draw_slip(found), title)
    return found.feasible and found.arrives, tables, facts, files


def summary(problem: GaitProblem, found: SlipTransfer) -> Table:
    """One row: the walk as planned, and as its replay ends."""
    unit = problem.goal.column_unit
    rows: dict[Column, object] = {
        Column("objective", words=True): problem.goal.words,
        Column("feasible", words=True): "yes" if found.feasible else "no walk found",
        Column("value", unit): found.value,
        Column("lower_bound", unit): found.lower_bound,
        Column("steps"): problem.steps_taken,
    }
    if (walked := found.replay) is None:
        return one_row(rows)
    return one_row(
        rows
        | {
            Column("duration", "s"): found.duration,
            Column("slid", "m"): found.slid,
            Column("distance", "m"): found.distance,
            Column("reserve"): found.reserve,
            Column("replay_arrives", words=True): "yes" if found.arrives else "no",
            Column("replay_slid", "m"): walked.slid,
            Column("replay_end_rate", "rad/s"): walked.end_rate,
            Column("replay_end_velocity", "m/s"): walked.end_velocity,
        }
    )


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
