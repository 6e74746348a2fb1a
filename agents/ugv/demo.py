"""The UGV's demo: leg angles over bumps, beside what an optimiser finds who knows them."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from stickslip.agents import load_policy
from stickslip.agents.evaluation.evaluate import evaluate
from stickslip.agents.evaluation.rollout import planned, rollout
from stickslip.agents.machine import Demonstration
from stickslip.agents.pictures.plots import plot_comparison
from stickslip.agents.pictures.training import TRAINED, write_products
from stickslip.agents.protocol import Task
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.agents.ugv.controllers import baseline
from stickslip.agents.ugv.evaluate import keep_of
from stickslip.agents.ugv.machine import FILM, UGV_BASELINES, VIEWED
from stickslip.agents.ugv.pictures import as_episode, compared
from stickslip.agents.ugv.task import training_task, with_options
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.training.configuration import Trained
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams

IN_TABLE = ("fixed-posture", "level-body")
"""Baselines of the table; all are on the one bump, planners included, which take seconds each."""

NOTE = """\
Drives that training does not see. The policy sees {ahead:g} m ahead; the fixed posture is the best
on each ground; the optimum knows all of it and is the least over a grid of angles. "with legs"
counts the legs' work, too. Over the paper's bump of 10 cm:"""


class UGVDemonstration(Demonstration[UGVTrainConfig]):
    """Bumps of 2 to 20 cm drawn at random, least work of the wheels' motors: the defaults.

    About half of their steps, and a smaller discount, with which less is needed.
    """

    directory: ClassVar = "demo-ugv"
    files: ClassVar = {
        "learning.png": "what was learnt when",
        "comparison.png": "the policy beside baselines, planner and optimum, over one bump",
        "episode.png": "the policy's drive over that bump",
        FILM: "the policy driving over it",
        "policy.npz": "the policy, for stickslip evaluate and stickslip view",
        "table.csv": "the table above (table.json: every episode)",
    }

    def config(self) -> UGVTrainConfig:
        """See Demonstration."""
        return UGVTrainConfig.of(timesteps=327_680, discount=0.95)

    def task_in_words(self, config: UGVTrainConfig) -> str:
        """See Demonstration."""
        return (
            f"leg angles for the least {config.criterion.replace('_', ' ')} on {config.tracks},\n"
            f"seen at {config.preview} points of the {config.preview_length:g} m ahead."
        )

    def show(self, trained: Trained, say: Callable[[str], None]) -> str:
        """See Demonstration."""
        config, directory = trained.config, trained.directory
        task = training_task(config)
        env, policy = task.env, {TRAINED: load_policy(trained.policy)}
        baselines = {name: baseline(name, env) for name in UGV_BASELINES}
        tabled = {name: baselines[name] for name in IN_TABLE} | policy
        count = config.evaluation_episodes  # the policy's program is then compiled already
        table = evaluate(env, tabled, {config.tracks: task.tested}, episodes=count)
        say("Planning a drive over one bump ...")
        unchanged = {"friction": None, "criterion": None}
        bump = with_options(Task(env, task.tested), unchanged, VIEWED, False).params
        played = {
            name: rollout(env, planned(env, one, bump, 0), bump, 0)
            for name, one in (baselines | policy).items()
        }
        lines = [
            f"{table.to_text().rstrip()}\n",
            NOTE.format(ahead=config.preview_length),
            *_lines(played, env, bump),
        ]
        text = "\n".join(lines) + "\n"
        say("\n" + text)
        say("Drawing ...")
        title = "Over the paper's bump of 10 cm"
        episodes = [as_episode(of, env, bump, name) for name, of in played.items()]
        plot_comparison(episodes, compared(env), directory / "comparison.png", title)
        write_products(trained, played[TRAINED], bump)
        self.write_tables(trained, table)
        return text


def _lines(played: Mapping[str, Rollout], env: UGVEnv, params: UGVEnvParams) -> list[str]:
    """A drive of each controller, a line each."""
    width, unit = max(map(len, played)), env.measure.unit
    kept = {name: keep_of(one, params) for name, one in played.items()}
    best = kept["optimum"]
    least = float(best.cost) if int(best.status) == Status.OK else float("nan")
    lines = []
    for name, one in kept.items():
        status = Status(int(one.status))
        end = "" if status == Status.OK else f", failed after {one.distance:.1f} m: {status.name}"
        lines.append(
            f"  {name:<{width}} {one.cost:7.1f} {unit}  "
            f"{one.cost / least:5.3f} of the optimum  "
            f"with legs {one.total_energy:6.1f} J  friction {one.demand:5.3f}{end}"
        )
    return lines


def demonstration() -> UGVDemonstration:
    """See Machine."""
    return UGVDemonstration()
