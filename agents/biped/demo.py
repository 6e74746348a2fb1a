"""The biped's demo: a floor too slippery for constant speed."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import jax

from stickslip.agents import load_policy
from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.controllers import CONTROLLERS
from stickslip.agents.biped.machine import FILM, STOPPING
from stickslip.agents.biped.pictures import COMPARED, as_episode
from stickslip.agents.biped.task import training_task
from stickslip.agents.evaluation.evaluate import evaluate
from stickslip.agents.evaluation.rollout import rollout
from stickslip.agents.machine import Demonstration
from stickslip.agents.pictures.plots import plot_comparison
from stickslip.agents.pictures.training import TRAINED, write_products

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.agents.biped.controllers import BipedController
    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.training.configuration import Trained
    from stickslip.envs.biped.state import BipedEnvState


class BipedDemonstration(Demonstration[TrainConfig]):
    """mu_s = 0.06, mu_k = 0.05, 3 rad/s: the defaults."""

    files: ClassVar = {
        "learning.png": "what was learnt when",
        "comparison.png": "the policy beside the baselines, from rest",
        "episode.png": "the policy's torque, speed and friction, from rest",
        FILM: "the policy walking",
        "policy.npz": "the policy, for stickslip evaluate and stickslip view",
        "table.csv": "the table above (table.json: every episode)",
    }

    def config(self) -> TrainConfig:
        """See Demonstration."""
        return TrainConfig.of(mu_static=0.06, mu_kinetic=0.05, mean_rate=3.0)

    def task_in_words(self, config: TrainConfig) -> str:
        """See Demonstration."""
        return (
            f"static friction {config.mu_static}, kinetic {config.mu_kinetic}, commanded "
            f"{config.mean_rate} rad/s on average\n"
            "(at a constant 3 rad/s the foot holds from a friction of 0.08 up)."
        )

    def show(self, trained: Trained[TrainConfig], say: Callable[[str], None]) -> str:
        """See Demonstration."""
        task, directory = training_task(trained.config), trained.directory
        controllers: dict[str, BipedController] = {
            name: kind() for name, kind in CONTROLLERS.items() if name != STOPPING
        }
        controllers[TRAINED] = load_policy(trained.policy)
        count = trained.config.evaluation_episodes  # the policy's program is then compiled already
        moving = evaluate(task.env, controllers, {"moving start": task.tested}, episodes=count)
        rest = task.described
        played = {name: rollout(task.env, one, rest, 0) for name, one in controllers.items()}
        period = float(rest.control_period)
        width = max(len(name) for name in played)
        lines = [
            f"{moving.to_text().rstrip()}\n",
            f"{count} episodes of 10 s from any phase and crank rate up to the commanded one. The "
            "baselines\nread the true state and masses, the policy its observation. From rest:",
            *(_line(f"{name:<{width}}", one, period) for name, one in played.items()),
        ]
        text = "\n".join(lines) + "\n"
        say("\n" + text)
        say("Drawing ...")
        title = "From rest on a slippery floor"
        episodes = [as_episode(of, task.env, rest, name) for name, of in played.items()]
        plot_comparison(episodes, COMPARED, directory / "comparison.png", title)
        write_products(trained, played[TRAINED])
        self.write_tables(trained, moving)
        return text


def _line(name: str, played: Rollout[BipedEnvState], period: float) -> str:
    """An episode from rest in a line."""
    last = jax.tree.map(lambda leaf: float(leaf[-1]), played.state.totals)
    seconds = int(played.length) * period
    return (
        f"  {name} return {last.reward:6.2f}  {last.walked / seconds:6.3f} m/s  "
        f"walked {last.walked:6.3f} m, distance slid {last.slid:6.4f} m, took {last.energy:5.1f} J "
        f"in {seconds:.1f} s"
    )


def demonstration() -> BipedDemonstration:
    """See Machine."""
    return BipedDemonstration()
