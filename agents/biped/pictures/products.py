"""What a finished run leaves to look at: plots and an animation of its policy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents import load_policy
from stickslip.agents.biped.names import FILM, FRAMES
from stickslip.agents.biped.pictures.plots import plot_episode
from stickslip.agents.biped.training import make_task
from stickslip.agents.evaluation.rollout import Rollout, rollout
from stickslip.agents.pictures.film import write_film
from stickslip.agents.pictures.learning import SCORE, Panel, plot_panels
from stickslip.envs.rendering import theme

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes

    from stickslip.agents.biped.config import TrainConfig
    from stickslip.agents.training.configuration import Trained
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState

FILM_TIME = 6.0
"""Seconds of walking in the animation."""
PANELS = (
    Panel("return of a whole episode [-]", None, "return"),
    Panel("mean crank rate [rad/s]", "mean_crank_rate", "mean_crank_rate"),
    Panel("falls [% of episodes]", "falls", "falls", share=100.0),
    Panel("distance slid [m/m]", "slip_per_metre", "slip_per_metre", log=True),
    Panel("energy [J/m]", "energy_per_metre", "energy_per_metre", log=True),
    Panel("exploration noise [N m]", "noise", None),
)


def write_products(
    trained: Trained[TrainConfig], played: Rollout[BipedEnvState] | None = None
) -> list[Path]:
    """Write learning.png, episode.png and walk.gif into the run's directory; return their paths.

    played: the policy's episode from rest, if it is there already.
    """
    task = make_task(trained.config)
    if played is None:
        played = rollout(task.env, load_policy(trained.policy), task.rest, 0)
    directory = trained.directory
    where = trained.config.task
    title = f"The {trained.name}, {'from rest' if where is None else f'on {where}'}"
    return [
        plot_learning(directory, trained.config, task.rest),
        plot_episode(played, task.rest, directory / "episode.png", title),
        write_film(task.env, played, task.rest, directory / FILM, FRAMES, FILM_TIME),
    ]


def plot_learning(directory: Path, config: TrainConfig, params: BipedEnvParams) -> Path:
    """`plot_panels` for the biped; params: of the task."""
    panels = list(PANELS)
    if config.task is not None:
        panels[0] = SCORE
    if config.algorithm != "sac":
        panels[-1] = panels[-1]._replace(share=float(params.torque_limit))
    else:
        panels[-1] = Panel("entropy weight [-]", "entropy_weight", None, log=True)

    def commanded(axes: list[Axes]) -> None:
        if params.randomisation.commanded_rate is not None:
            return
        axes[1].axhline(float(params.commanded_rate), color=theme.MUTED, lw=0.9, ls=(0, (4, 3)))
        axes[1].set_title("dashed: commanded", loc="right", fontsize=8.5, color=theme.MUTED)

    return plot_panels(directory, config, panels, "biped", commanded)
