"""Pictures of a finished training run. Needs the extra `viz` (or `train`, which holds it)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents import load_policy
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.machine import machine_by_name
from stickslip.agents.pictures.episodes import plot_episode, write_film
from stickslip.agents.training.directory import read_columns
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.sheet import make_sheet, name_panel, save_sheet, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.agents.training.configuration import Configuration, Trained

TRAINED = "trained policy"
COLUMNS = 3


def write_products(trained: Trained[Configuration]) -> list[Path]:
    """Write learning.png, episode.png and the machine's film into the run's directory."""
    config, directory = trained.config, trained.directory
    machine = machine_by_name(config.machine)
    task = machine.training_task(config)
    shown = task.described
    last = rollout(task.env, load_policy(trained.policy), shown, 0)
    title = f"The {TRAINED}" + ("" if config.task is None else f" on {config.task}")
    episode, film = machine.as_episode(last, task.env, shown, TRAINED), directory / "episode.gif"
    return [
        plot_learning(directory, config),
        plot_episode(episode, directory / "episode.png", title),
        write_film(task.env, last, shown, film, machine.frames, machine.film_time),
    ]


@styled
def plot_learning(directory: Path, config: Configuration) -> Path:
    """Write learning.png into a run's directory: its evaluations, with 95 % bands; return it."""
    machine = machine_by_name(config.machine)
    panels = learning_panels(config)
    metrics = read_columns(directory / "metrics.csv")
    tests = read_columns(directory / "evaluations.csv")
    seconds = (metrics.get("seconds") or [0.0])[-1]
    where = f"the {machine.title}" if config.task is None else config.task
    title = f"PPO on {where}: {seconds:.0f} s of training, evaluations aside"
    rows = -(-len(panels) // COLUMNS)
    figure, axes = make_sheet(rows, COLUMNS, (11, 2.8 * rows), title)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    axes = axes[: len(panels)]
    unit, scale = ("millions", 1e6) if config.timesteps >= 500_000 else ("thousands", 1e3)
    for axis, (column, (name, factor)) in zip(axes, panels.items(), strict=True):
        name_panel(axis, name)
        _draw(axis, column, metrics if column == "noise" else tests, factor, scale)
    for axis in axes[-COLUMNS:]:
        axis.set_xlabel(f"control steps [{unit}]")
    return save_sheet(figure, directory / "learning.png")


def learning_panels(config: Configuration) -> dict[str, tuple[str, float]]:
    """Panels of a run's learning curves, the score on a named task, `evaluated` and the noise, by
    their columns: title, and the factor from the column's unit to the panel's."""
    machine = machine_by_name(config.machine)
    columns = machine.measures(machine.training_task(config).env).columns
    shown = {name: columns[name][0] for name in machine.evaluated}
    score = {"task_score": ("score (0: doing nothing, 1: best known)", 1.0)}
    panels = {name: (one.title, 100.0 if one.percent else 1.0) for name, one in shown.items()}
    return (score if config.task else {}) | panels | {"noise": ("exploration: noise", 1.0)}


def _draw(
    axis: Axes, column: str, table: dict[str, list[float]], factor: float, scale: float
) -> None:
    """A column of a run's table over its steps, with its 95 % band where there is one."""
    if not table.get(column):
        return
    steps = np.asarray(table["timesteps"]) / scale
    marker, colour = "o" if len(steps) < 3 else None, theme.SLIDES
    axis.plot(steps, factor * np.asarray(table[column]), marker=marker, ms=4, color=colour)
    if f"{column}_low" in table:
        low, high = (factor * np.asarray(table[f"{column}_{end}"]) for end in ("low", "high"))
        axis.fill_between(steps, low, high, color=colour, alpha=0.18, lw=0)
