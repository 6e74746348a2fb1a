"""What a finished run of the UGV leaves to look at: plots and an animation of its policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.film import write_film
from stickslip.agents.pictures.learning import Panel, plot_panels
from stickslip.agents.pictures.sheet import make_sheet, name_below, save_sheet
from stickslip.agents.policy import load_policy
from stickslip.agents.ugv.names import FILM, FRAMES
from stickslip.agents.ugv.training import make_ugv_task
from stickslip.envs.rendering import theme
from stickslip.envs.ugv.draw import ground

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.training.trained import Trained
    from stickslip.agents.ugv.config import UGVTrainConfig
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


def write_products(
    trained: Trained[UGVTrainConfig], played: Rollout[UGVEnvState] | None = None
) -> list[Path]:
    """Write learning.png, episode.png and drive.gif into the run's directory; their paths.

    played: the policy's first test episode, if it is there already.
    """
    config = trained.config
    task = make_ugv_task(config)
    if played is None:
        played = rollout(task.env, load_policy(trained.policy), task.test, 0)
    directory = trained.directory
    return [
        plot_panels(directory, config, _panels(task.env), "UGV"),
        plot_drive(played, task.env, task.test, directory / "episode.png", f"The {trained.name}"),
        write_film(task.env, played, task.test, directory / FILM, FRAMES),
    ]


def plot_drive(
    played: Rollout[UGVEnvState], env: UGVEnv, params: UGVEnvParams, path: str | Path, title: str
) -> Path:
    """One episode over the way: ground, leg angles, torque, grip and cost, as a PNG."""
    played = played.trimmed()
    at, cost = jax.tree.map(
        lambda first, rest: np.concatenate([np.asarray(first)[None], rest]),
        *((one.station, one.cost) for one in (played.start_state, played.state)),
    )
    track = ground(played.start_state.drawn, params)[0].track
    figure, axes = make_sheet(5, 1, (9, 9), title)
    fine = np.linspace(float(params.track.start), float(params.end), 400)
    axes[0].plot(fine, track.height(jnp.asarray(fine)), color=theme.INK)
    angles = np.degrees(at.leg_angles)
    axes[1].plot(at.x, angles[:, 0], color=theme.HOLDS, label="rear")
    axes[1].plot(at.x, angles[:, 1], color=theme.INK, ls="--", label="front")
    axes[1].legend(frameon=False, fontsize=9)
    axes[2].plot(at.x, at.torque, color=theme.MOTOR)
    axes[3].plot(at.x, at.grip / 1000, color=theme.SLIDES)
    axes[4].plot(at.x, cost, color=theme.INK)
    measure = env.measure
    titles = (
        "ground [m]",
        "leg angles [°]",
        "torque on each wheel [N m]",
        "margin of grip [kN]",
        f"{measure.name.replace('_', ' ')} [{measure.unit}]",
    )
    for axis, words in zip(axes, titles, strict=True):
        axis.set_title(words, loc="left", fontsize=10, color=theme.INK, pad=4)
    name_below(axes[-1], "front wheel [m]")
    return save_sheet(figure, path)


def _panels(env: UGVEnv) -> tuple[Panel, ...]:
    name, unit = env.measure.name.replace("_", " "), env.measure.unit
    return (
        Panel(f"return of a whole episode [{unit}]", None, "return"),
        Panel(f"{name} [{unit}]", "cost", "cost"),
        Panel("cost / optimum [-]", None, "score"),
        Panel("failures [% of episodes]", "failures", "failures", share=100.0),
        Panel("work of motors and legs [J]", "total_energy", "total_energy"),
        Panel("exploration noise [leg rates]", "noise", None),
    )
