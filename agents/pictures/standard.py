"""Pictures of any machine's runs and episodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.evaluation.rollout import AnyRollout, rollout
from stickslip.agents.pictures.film import write_film
from stickslip.agents.pictures.learning import Panel, plot_panels
from stickslip.agents.pictures.sheet import make_sheet, name_below, save_sheet
from stickslip.agents.policy.file import load_policy
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.machine import Config, Env, Machine, Params, TrainingTask
    from stickslip.agents.protocol import AnyEnv, Timed
    from stickslip.agents.training.configuration import Trained


def write_products(
    machine: Machine[Env, Params, Config],
    task: TrainingTask[Env, Params],
    trained: Trained[Config],
    played: AnyRollout | None,
) -> list[Path]:
    """See Machine: learning curves, the policy's first episode over time, and as an animation."""
    if played is None:
        played = rollout(task.env, load_policy(trained.policy), task.tested, 0)
    panels = [
        Panel(name.replace("_", " "), name if name in machine.episode else None, name)
        for name in machine.evaluated
    ]
    directory, title = trained.directory, f"The {trained.name}"
    return [
        plot_panels(directory, trained.config, panels, machine.title),
        machine.plot_episode(played, task.env, task.tested, directory / "episode.png", title),
        write_film(task.env, played, task.tested, directory / machine.film, machine.frames),
    ]


def plot_episode(
    played: AnyRollout, env: AnyEnv, params: Timed, path: str | Path, title: str
) -> Path:
    """Actions, reward and the numbers of the info over time, as a PNG."""
    played = played.trimmed()
    rows = {name: played.action[:, i] for i, name in enumerate(env.action_names)}
    rows["reward"] = played.reward
    rows |= {
        name: value
        for name, value in played.info.items()
        if np.ndim(value) == 1 and np.asarray(value).dtype.kind == "f"
    }
    time = np.arange(1, len(played.reward) + 1) * float(params.control_period)
    figure, axes = make_sheet(len(rows), 1, (9, 1.2 + 1.5 * len(rows)), title)
    for axis, (name, values) in zip(axes, rows.items(), strict=True):
        axis.plot(time, values, color=theme.INK, lw=1.2)
        axis.set_title(name.replace("_", " "), loc="left", fontsize=10, color=theme.INK, pad=4)
    name_below(axes[-1], "time [s]")
    return save_sheet(figure, path)
