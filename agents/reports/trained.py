"""A training run as a page: what was learnt when, with what settings, and the policy at work."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.policy.file import load_policy
from stickslip.agents.reports.course import scale_of
from stickslip.agents.reports.evaluated import first_episodes
from stickslip.agents.reports.writing import REPORT, write_page
from stickslip.agents.training.metrics import KEY, read_columns
from stickslip.agents.training.run import best_evaluation
from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine
    from stickslip.agents.training.configuration import Configuration
    from stickslip.agents.training.trained import Trained

KEY_OF_SCORE = "task_score"
"""Of a run on a named task, before all others."""


def write_training(trained: Trained[Configuration], machine: AnyMachine) -> Path:
    """Write report.html into a run's directory, in place of one that is there; return its path."""
    return write_page(training_page(trained, machine), trained.directory / REPORT, overwrite=True)


def training_page(trained: Trained[Configuration], machine: AnyMachine) -> Page:
    """Curves of both tables of the run, its configuration, and the policy's episode of seed 0."""
    config, directory = trained.config, trained.directory
    where = f"the {machine.title}" if config.task is None else config.task
    steps, best = best_evaluation(directory)
    task = machine.training_task(config)
    policy = load_policy(trained.policy)
    players = [(where, trained.name, task.env, policy, task.tested)]
    facts = (
        ("trained", f"{trained.timesteps:,} of {config.timesteps:,} steps"),
        ("time", f"{trained.seconds:.0f} s"),
        ("best evaluation", f"return {best:.4g} after {steps:,} steps"),
        ("seed", str(config.seed)),
    )
    settings = [[one.name, str(getattr(config, one.name))] for one in fields(config)]  # pyright: ignore[reportArgumentType], a dataclass
    columns = [Column("setting", words=True), Column("value", words=True)]
    return Page(
        title=f"{config.algorithm.upper()} on {where}",
        lead="" if trained.finished else f"Not finished: {trained.percent} % of the training.",
        facts=facts,
        episodes=first_episodes(players, 0, scale_of(config.task)),
        curves=(
            *_curves(directory / "evaluations.csv", machine.evaluated, "in evaluations"),
            *_curves(directory / "metrics.csv", machine.episode, "in training episodes"),
        ),
        closing=(("Configuration", Table(columns, settings)),),
    )


def _curves(path: Path, names: Iterable[str], what: str) -> list[Curve]:
    """One panel for each of a table's columns that is there."""
    found = read_columns(path)
    x = np.array(found.get(KEY, []), float)
    names = [KEY_OF_SCORE, *names]
    return [
        Curve(
            "steps",
            x,
            Panel(f"{name.replace('_', ' ')} {what}", "-", (Line(name, np.array(found[name])),)),
        )
        for name in names
        if name in found and name != "episodes" and np.isfinite(found[name]).any()
    ]
