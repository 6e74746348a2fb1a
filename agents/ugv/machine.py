"""The UGV as a machine. See stickslip.agents.machine.Machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.machine import Machine, Option
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.agents.ugv.names import AXES, FILM, FRAMES, UGV_BASELINES
from stickslip.agents.ugv.tracks import GROUND, TRACK_NAMES, VIEWED
from stickslip.optim.posture.names import CRITERIA_IN_WORDS

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from stickslip.agents.demonstration import Demonstration
    from stickslip.agents.evaluation.evaluate import Measures
    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.machine import TrainingTask
    from stickslip.agents.pictures.episodes import LearningPanel
    from stickslip.agents.protocol import Policy
    from stickslip.agents.ugv.evaluate import UGVEpisodes
    from stickslip.agents.ugv.names import UGVPlayer
    from stickslip.agents.ugv.swept import UGVSwept
    from stickslip.agents.ugv.task import UGVParts
    from stickslip.agents.ugv.training import UGVTask
    from stickslip.agents.untrusted import Json
    from stickslip.envs.rendering.page import Episode
    from stickslip.envs.tasks.known import Scale
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState


class UGVMachine(Machine["UGVEnv", "UGVEnvParams", UGVTrainConfig]):
    """The vehicle on legs: its scenes are grounds."""

    name, title = "ugv", "UGV"
    environment = "UGVEnv"
    outputs = 2
    configuration = UGVTrainConfig
    modules = (
        "stickslip.dynamics.ugv.params",
        "stickslip.dynamics.ugv.pose_solver",
        "stickslip.dynamics.ugv.ground.roughness",
        "stickslip.dynamics.ugv.ground.shapes",
        "stickslip.dynamics.ugv.ground.spline",
        "stickslip.dynamics.ugv.ground.surface",
        "stickslip.dynamics.ugv.track",
        "stickslip.envs.ugv.env",
        "stickslip.envs.ugv.randomisation",
    )
    baselines = UGV_BASELINES
    scenes, scene_files = TRACK_NAMES, "or a file of points"
    axes = AXES
    evaluated = ("return", "cost", "score", "total_energy", "demand", "failures")
    episode = ("episodes", "return", "cost", "length", "wheel_energy", "total_energy", "failures")
    film, frames = FILM, FRAMES

    def usual_scene(self, viewed: bool = False) -> str:
        """See Machine."""
        return VIEWED if viewed else GROUND

    def options(self, viewed: bool = False) -> tuple[Option, ...]:
        """See Machine."""
        return (
            Option("friction", "between wheels and ground [-]", metavar="MU"),
            Option(
                "criterion",
                "what is to be small, see below (default: the policy's own)",
                str,
                metavar="NAME",
            ),
        )

    def tables(self) -> dict[str, Mapping[str, str]]:
        """See Machine."""
        return {"criteria of the UGV": CRITERIA_IN_WORDS}

    def describe(self, env: UGVEnv, params: UGVEnvParams) -> dict[str, Json]:
        """See Machine."""
        from stickslip.agents.ugv import task

        return task.describe_ugv(env, params)

    def read_task(self, metadata: Mapping[str, Json]) -> UGVParts | None:
        """See Machine."""
        from stickslip.agents.ugv import task

        return task.read_task(metadata)

    def standard_task(self, metadata: Mapping[str, Json]) -> UGVParts:
        """See Machine."""
        from stickslip.agents.ugv import task

        return task.standard_task(metadata)

    def sightless(self, env: UGVEnv) -> UGVEnv:
        """See Machine."""
        from dataclasses import replace

        return replace(env, preview=0, see_friction=False)

    def baseline(self, name: str, env: UGVEnv) -> UGVPlayer:
        """See Machine."""
        from stickslip.agents.ugv.names import ugv_baseline

        return ugv_baseline(name, env)

    def measures(
        self, env: UGVEnv, *, task: bool = False, bound: bool = False
    ) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
        """See Machine, and `ugv_measures` for what is assumed."""
        from stickslip.agents.ugv.evaluate import ugv_measures

        return ugv_measures(env, optimum=not task, bound=bound)

    def unit_of(self, env: UGVEnv) -> str:
        """See Machine."""
        return f"{env.measure.unit} of {env.criterion}"

    def swept(self) -> UGVSwept:
        """See Machine."""
        from stickslip.agents.ugv.swept import UGVSwept

        return UGVSwept()

    def training_task(self, config: UGVTrainConfig) -> UGVTask:
        """See Machine."""
        from stickslip.agents.ugv.training import make_ugv_task

        return make_ugv_task(config)

    def evaluate_policy(
        self, task: TrainingTask[UGVEnv, UGVEnvParams], policy: Policy, config: UGVTrainConfig
    ) -> dict[str, float]:
        """See Machine."""
        from stickslip.agents.ugv.training import evaluate_policy

        return evaluate_policy(task, policy, config, self.evaluated)

    def summary(self, ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
        """See Machine."""
        from stickslip.agents.ugv.training import summary

        return summary(ended)

    def beside_bar(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        unknown = float("nan")
        return f"return {row.get('return', unknown):.2f}, cost {row.get('cost', unknown):.4g}"

    def line(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        of_best = f"{row['score']:6.3f} of the grid's best  " if "score" in row else ""
        return (
            f"return {row['return']:9.2f}  cost {row['cost']:9.4g}  {of_best}"
            f"with legs {row['total_energy']:7.1f} J  "
            f"failures {100 * row['failures']:3.0f} %"
        )

    def as_episode(
        self,
        played: AnyRollout,
        env: UGVEnv,
        params: UGVEnvParams,
        name: str,
        scale: Scale | None = None,
    ) -> Episode:
        """See Machine."""
        from stickslip.agents.ugv.pictures import as_episode

        return as_episode(played, env, params, name, scale)

    def learning_panels(self, config: UGVTrainConfig) -> list[LearningPanel]:
        """See Machine."""
        from stickslip.agents.ugv.pictures import learning_panels

        return learning_panels(config)

    def demonstration(self) -> Demonstration:
        """See Machine."""
        from stickslip.agents.ugv.demo import UGVDemonstration

        return UGVDemonstration()
