"""Products of a finished UGV run: plots and an animation of its policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents import load_policy
from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.film import write_film
from stickslip.agents.pictures.learning import SCORE, Panel, plot_panels
from stickslip.agents.ugv.names import FILM, FRAMES
from stickslip.agents.ugv.plots import plot_drive
from stickslip.agents.ugv.training import make_ugv_task

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.training.configuration import Trained
    from stickslip.agents.ugv.config import UGVTrainConfig
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


def write_products(
    trained: Trained[UGVTrainConfig],
    played: Rollout[UGVEnvState] | None = None,
    params: UGVEnvParams | None = None,
) -> list[Path]:
    """Write learning.png, episode.png and drive.gif into the run's directory; their paths.

    played: the policy's first test episode, if it is there already, or one with other params.
    """
    config = trained.config
    task = make_ugv_task(config)
    params = task.test if params is None else params
    if played is None:
        played = rollout(task.env, load_policy(trained.policy), params, 0)
    directory = trained.directory
    return [
        plot_panels(directory, config, _panels(task.env, config.task), "UGV"),
        plot_drive(played, task.env, params, directory / "episode.png", f"The {trained.name}"),
        write_film(task.env, played, params, directory / FILM, FRAMES),
    ]


def _panels(env: UGVEnv, task: str | None) -> tuple[Panel, ...]:
    name, unit = env.measure.name.replace("_", " "), env.measure.unit
    return (
        Panel(f"return of a whole episode [{unit}]", None, "return"),
        Panel(f"{name} [{unit}]", "cost", "cost"),
        Panel("cost / best over grid [-]", None, "score") if task is None else SCORE,
        Panel("failures [% of episodes]", "failures", "failures", share=100.0),
        Panel("work of motors and legs [J]", "total_energy", "total_energy"),
        Panel("exploration noise [leg rates]", "noise", None),
    )
