"""The biped as a machine. See stickslip.agents.machine.Machine."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.biped.names import AXES, BIPED_BASELINES, FILM, FRAMES
from stickslip.agents.biped.scenes import SCENE, SCENES
from stickslip.agents.machine import Machine, Option

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np

    from stickslip.agents.biped.controllers import BipedController
    from stickslip.agents.biped.evaluate import Episodes
    from stickslip.agents.biped.state_map import BipedStates
    from stickslip.agents.biped.swept import BipedSwept
    from stickslip.agents.biped.task import BipedTask
    from stickslip.agents.biped.training import Task as BipedTraining
    from stickslip.agents.demonstration import Demonstration
    from stickslip.agents.evaluation.evaluate import Measures
    from stickslip.agents.evaluation.rollout import AnyRollout
    from stickslip.agents.machine import Options, Task, TrainingTask
    from stickslip.agents.pictures.episodes import LearningPanel
    from stickslip.agents.protocol import AnyPlayer, Policy
    from stickslip.agents.untrusted import Json
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState
    from stickslip.envs.rendering.page import Episode
    from stickslip.envs.tasks.known import Scale

STARTS = ("moving", "rest")


class BipedMachine(Machine["BipedEnv", "BipedEnvParams", TrainConfig]):
    """PASIBOT: its scenes are floors."""

    name = title = "biped"
    environment = "BipedEnv"
    outputs = 1
    configuration = TrainConfig
    modules = (
        "stickslip.dynamics.biped.params",
        "stickslip.dynamics.biped.fidelity",
        "stickslip.dynamics.biped.coefficients.table",
        "stickslip.dynamics.biped.coefficients.series",
        "stickslip.dynamics.biped.stepping.integrators",
        "stickslip.dynamics.biped.trade.settings",
        "stickslip.dynamics.scene",
        "stickslip.envs.biped.env",
        "stickslip.envs.biped.params",
    )
    baselines = BIPED_BASELINES
    scenes = tuple(SCENES)
    axes = AXES
    evaluated = (
        "return",
        "mean_speed",
        "mean_crank_rate",
        "slip_per_metre",
        "energy_per_metre",
        "falls",
    )
    episode = (
        "episodes",
        "return",
        "duration",
        "mean_crank_rate",
        "speed",
        "slip_per_metre",
        "energy_per_metre",
        "falls",
    )
    film, frames, film_time = FILM, FRAMES, 6.0

    def usual_scene(self, viewed: bool = False) -> str:
        """See Machine."""
        return SCENE

    def options(self, viewed: bool = False) -> tuple[Option, ...]:
        """See Machine."""
        usual = "rest" if viewed else "moving"
        return (
            Option("mu_static", "one floor instead", metavar="MU"),
            Option("mu_kinetic", "its kinetic friction", metavar="MU"),
            Option("payload", "mass on the hip [kg]", metavar="KG"),
            Option("commanded_rate", "mean crank rate [rad/s]", metavar="RATE"),
            Option(
                "start",
                f"from any phase and rate up to the commanded one, or from rest (default: {usual})",
                str,
                choices=STARTS,
            ),
        )

    def require_options(self, options: Options) -> None:
        """See Machine."""
        if options["mu_static"] is not None and options["scenes"]:
            raise ValueError(
                f"--mu-static {options['mu_static']:g} with --scene {' '.join(options['scenes'])}; "
                "accepted: one of them, both say which floor"
            )
        if options["mu_kinetic"] is not None and options["mu_static"] is None:
            raise ValueError(
                f"mu_kinetic = {options['mu_kinetic']:g} without mu_static; accepted: both, "
                "mu_static alone or neither"
            )

    def describe(self, env: BipedEnv, params: BipedEnvParams) -> dict[str, Json]:
        """See Machine."""
        from stickslip.agents.biped import task

        return task.describe_environment(env, params)

    def read_task(self, metadata: Mapping[str, Json]) -> BipedTask | None:
        """See Machine."""
        from stickslip.agents.biped import task

        return task.read_task(metadata)

    def standard_task(self, metadata: Mapping[str, Json]) -> BipedTask:
        """See Machine."""
        from stickslip.agents.biped import task

        return task.standard_task(metadata)

    def params_of(
        self, task: Task[BipedEnv, BipedEnvParams], options: Options, viewed: bool
    ) -> BipedEnvParams:
        """See Machine."""
        from stickslip.agents.biped.task import begun

        return begun(task.params(), options["start"], "rest" if viewed else "moving")

    def sightless(self, env: BipedEnv) -> BipedEnv:
        """See Machine."""
        from dataclasses import replace

        return replace(env, see_friction=False, see_patch=False)

    def baseline(self, name: str, env: BipedEnv) -> BipedController:
        """See Machine; a baseline suits every environment."""
        from stickslip.agents.biped.controllers import controller_by_name

        return controller_by_name(name)

    def state_map(self, env: BipedEnv, params: BipedEnvParams) -> BipedStates:
        """See Machine."""
        from stickslip.agents.biped.state_map import BipedStates

        return BipedStates.of(env, params)

    def measures(
        self, env: BipedEnv, *, task: bool = False, bound: bool = False
    ) -> Measures[BipedEnvState, BipedEnvParams, Episodes]:
        """See Machine."""
        self.require_no_bound(bound)
        from stickslip.agents.biped.evaluate import MEASURES

        return MEASURES

    def amplifications(
        self, env: BipedEnv, player: AnyPlayer, params: BipedEnvParams, seeds: Sequence[int]
    ) -> np.ndarray:
        """See Machine."""
        from stickslip.agents.biped.amplification import amplifications

        return amplifications(env, player, params, seeds)

    def swept(self) -> BipedSwept:
        """See Machine."""
        from stickslip.agents.biped.swept import BipedSwept

        return BipedSwept()

    def training_task(self, config: TrainConfig) -> BipedTraining:
        """See Machine."""
        from stickslip.agents.biped.training import make_task

        return make_task(config)

    def evaluate_policy(
        self,
        task: TrainingTask[BipedEnv, BipedEnvParams],
        policy: Policy,
        config: TrainConfig,
    ) -> dict[str, float]:
        """The standard reward over whole episodes from anywhere, deterministic."""
        from stickslip.agents.biped.training import evaluate_policy

        return evaluate_policy(task, policy, config, self.evaluated)

    def summary(self, ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
        """Means over the episodes and ratios of sums."""
        from stickslip.agents.biped.training import summary

        return summary(ended, period)

    def beside_bar(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        unknown = float("nan")
        rate = row.get("mean_crank_rate", unknown)
        return f"return {row.get('return', unknown):.2f}, {rate:.2f} rad/s"

    def line(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        return (
            f"return {row['return']:6.2f}  "
            f"{row['mean_crank_rate']:5.2f} rad/s  slip {row['slip_per_metre']:7.4f} m/m  "
            f"energy {row['energy_per_metre']:6.1f} J/m  falls {100 * row['falls']:3.0f} %"
        )

    def as_episode(
        self,
        played: AnyRollout,
        env: BipedEnv,
        params: BipedEnvParams,
        name: str,
        scale: Scale | None = None,
    ) -> Episode:
        """See Machine."""
        from stickslip.agents.biped.pictures import as_episode

        return as_episode(played, params, name, scale)

    def learning_panels(self, config: TrainConfig) -> list[LearningPanel]:
        """See Machine."""
        from stickslip.agents.biped.pictures import learning_panels

        return learning_panels(config)

    def params_to_view(self, params: BipedEnvParams, seconds: float) -> BipedEnvParams:
        """An episode is as long as what is shown of it."""
        return params.replace(time_limit=seconds)

    def demonstration(self) -> Demonstration:
        """See Machine."""
        from stickslip.agents.biped.demo import BipedDemonstration

        return BipedDemonstration()
