"""`stickslip optimise biped --mu-kinetic`: a walk whose foot may slip, its replay, the files."""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.optim import GaitProblem, SlipTransfer, best_transfer, slip_transfer
from stickslip.optimise.picture import draw_slip
from stickslip.records.table import Column, Content, Table, json_text
from stickslip.report import RESULT, one_row, picture, show, write_result

NODES, PICTURE = "walk.csv", "walk.png"
STATED = ("value", "lower_bound", "feasible", "reserve", "duration", "slid", "distance")
ARRAYS = ("theta", "clock", "crank_rate", "foot_velocity", "torque")


def slip_command(problem: GaitProblem, most: int, given: Namespace, out: Path) -> Content:
    """Find the best walk of problem.steps_taken to `most` steps, print it and write it to `out`."""
    options: dict[str, Any] = {"mu_kinetic": given.mu_kinetic, "feedback": given.feedback}
    options |= {"reserve": given.reserve or None, "progress": True}
    problem, found = best_transfer(problem, most, slip_transfer, **options)
    tables = {"summary": summary(problem, found)}
    facts: dict[str, object] = {name: getattr(found, name) for name in STATED + ARRAYS}
    files: dict[str, Any] = {}
    if found.feasible:
        facts |= {"replay": asdict(found.replay), "arrives": found.arrives}
        files[NODES] = walk_table(found).csv
        if given.pictures:
            title = f"Least {problem.goal.words} where the foot may slip: {found.value:.4g}"
            files[PICTURE] = picture(lambda: draw_slip(found), title)
    show(*tables.values())
    content = {"asked": vars(given), "robot": problem.params, "result": facts}
    files = {RESULT: lambda: json_text(content), **files}
    written = write_result(out, files, (NODES, PICTURE), given.overwrite)
    status = OK if found.feasible and found.arrives else NOTHING_FOUND
    return Content(tables, content | {"files": written}, status=status)


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
