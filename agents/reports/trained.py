"""A training run as a page: what was learnt when, with what settings, and the policy at work."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.policy.file import load_policy
from stickslip.agents.registry import machine_of_config
from stickslip.agents.reports.course import scale_of
from stickslip.agents.reports.evaluated import first_episodes
from stickslip.agents.reports.writing import REPORT, write_page, written_or_told
from stickslip.agents.training.configuration import Settings
from stickslip.agents.training.groups import SHARED
from stickslip.agents.training.metrics import KEY, read_columns
from stickslip.agents.training.run import best_evaluation
from stickslip.envs.rendering.html.data import Curve, Line, Page, Panel
from stickslip.records.table import Column, Table

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from stickslip.agents.machine import AnyMachine, TrainingTask
    from stickslip.agents.protocol import AnyEnv, Timed
    from stickslip.agents.training.configuration import Configuration
    from stickslip.agents.training.trained import Trained

KEY_OF_SCORE = "task_score"
"""Of a run on a named task, before all others."""
MEAN = "mean_"
"""Before the names of some measures, whose training column is without."""


class Shown(NamedTuple):
    """How a column is shown. share: its unit in that of the panel. words: behind its title."""

    unit: str = "-"
    share: float = 1.0
    words: str = ""


def report_training(trained: Trained[Configuration]) -> Path | None:
    """Write report.html into a run's directory, in place of one that is there; return its path.

    Where that fails, there is a warning and no path.
    """
    machine = machine_of_config(trained.config)

    def write() -> Path:
        page = training_page(trained, machine)
        return write_page(page, trained.directory / REPORT, overwrite=True)

    return written_or_told(trained.directory, write)


def training_page(trained: Trained[Configuration], machine: AnyMachine) -> Page:
    """Curves of both tables of the run, its configuration, and the policy's episode of seed 0."""
    config, directory = trained.config, trained.directory
    where = f"the {machine.title}" if config.task is None else config.task
    steps, best = best_evaluation(directory)
    task = machine.training_task(config)
    units = _units(machine, task)
    scale = _scale(task)
    scaled = {"return": Shown(words=f"of rewards times {scale:.4g}")}
    training = units if scale == 1 else units | scaled
    policy = load_policy(trained.policy)
    players = [(where, trained.name, task.env, policy, task.tested)]
    facts = (
        ("trained", _steps_in_words(trained)),
        ("time", f"{trained.seconds:.0f} s"),
        ("best evaluation", f"return {best:.4g} after {steps:,} steps"),
        ("seed", str(config.seed)),
    )
    columns = [Column("setting", words=True), Column("value", words=True)]
    return Page(
        title=f"{config.algorithm.upper()} on {where}",
        lead="" if trained.finished else f"Not finished: {trained.percent} % of the training.",
        facts=facts,
        episodes=first_episodes(players, 0, scale_of(config.task)),
        curves=(
            *_curves(directory / "evaluations.csv", machine.evaluated, "in evaluations", units),
            *_curves(directory / "metrics.csv", machine.episode, "in training episodes", training),
        ),
        over="Learning",
        closing=(("Configuration", Table(columns, _settings(config))),),
    )


def _steps_in_words(trained: Trained[Configuration]) -> str:
    """Whole updates may make more steps than were asked for."""
    done, asked = trained.timesteps, trained.config.timesteps
    if done < asked:
        return f"{done:,} of {asked:,} steps"
    return f"{done:,} steps" + (f", {asked:,} asked for" if done > asked else "")


def _settings(config: Configuration) -> list[tuple[str, str]]:
    """What the run went by: of groups that of its algorithm, one after the other; of a named task,
    which says the rest, those of learning alone."""
    found = []
    for one in fields(config):  # pyright: ignore[reportArgumentType], a dataclass
        value = getattr(config, one.name)
        if isinstance(value, Settings):
            if one.name == config.algorithm:
                inner = ((each.name, getattr(value, each.name)) for each in fields(value))  # pyright: ignore[reportArgumentType], likewise
                found += [(f"{one.name}.{name}", str(number)) for name, number in inner]
        elif value is not None and (config.task is None or one.name in SHARED):
            found.append((one.name, str(value)))
    return found


def _units(machine: AnyMachine, task: TrainingTask[AnyEnv, Timed]) -> dict[str, Shown]:
    """How the columns of both tables are shown: as the machine's evaluations show the measures of
    their names. Of others nothing is known."""
    found = {
        name: Shown(one.unit, 100.0 if one.percent else 1.0)
        for name, (one, _) in machine.measures(task.env).columns.items()
    }
    found |= {
        name.removeprefix(MEAN): one for name, one in found.items() if name.startswith(MEAN)
    } | {"length": Shown("steps")}
    if unit := machine.unit_of(task.env).partition(" of ")[0]:
        found["return"] = Shown(unit)
    return found


def _scale(task: TrainingTask[AnyEnv, Timed]) -> float:
    """By how much the reward of training episodes is more than that of evaluations."""
    scales = [getattr(one, "reward_scale", 1.0) for one in (task.training, task.tested)]
    return float(scales[0]) / float(scales[1])


def _curves(path: Path, names: Iterable[str], what: str, units: Mapping[str, Shown]) -> list[Curve]:
    """One panel for each of a table's columns that is there."""
    found = read_columns(path)
    x = np.array(found.get(KEY, []), float)
    made = []
    for name in (KEY_OF_SCORE, *names):
        if name in found and name != "episodes" and np.isfinite(found[name]).any():
            words = name.replace("_", " ")
            shown = units.get(name, Shown())
            line = Line(words, shown.share * np.array(found[name]))
            title = f"{words} {what}" + (f", {shown.words}" if shown.words else "")
            made.append(Curve("steps", x, Panel(title, shown.unit, (line,))))
    return made
