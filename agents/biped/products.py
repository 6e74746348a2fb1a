"""What a finished run leaves to look at: plots and an animation of its policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.biped.training import make_task
from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.film import pictures, plot_episode
from stickslip.agents.pictures.learning import plot_learning
from stickslip.agents.policy import load_policy
from stickslip.envs.rendering import save_animation

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.training.run import Trained
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams

FPS = 25.0
FILM_TIME = 6.0
"""Seconds of walking in the animation."""


def write_products(trained: Trained, played: Rollout | None = None) -> list[Path]:
    """Write learning.png, episode.png and walk.gif into the run's directory; return their paths.

    played: the policy's episode from rest, if it is there already.
    """
    task = make_task(trained.config)
    if played is None:
        played = rollout(task.env, load_policy(trained.policy), task.rest, 0)
    directory = trained.directory
    limit, title = float(task.rest.torque_limit), f"The {trained.name}, from rest"
    return [
        plot_learning(directory, trained.config, limit),
        plot_episode(played, task.rest, directory / "episode.png", title),
        write_film(task.env, played, task.rest, directory / "walk.gif", FILM_TIME),
    ]


def write_film(
    env: BipedEnv, played: Rollout, params: BipedEnvParams, path: Path, seconds: float
) -> Path:
    """The first seconds of an episode that was played, as an animation."""
    steps = min(int(played.length), max(1, round(seconds / float(params.control_period))))
    return save_animation(pictures(env, played._replace(length=steps), params, FPS), path, FPS)
