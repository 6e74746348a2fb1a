"""A machine of which little is known: what does for most, so that a new one is short."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from stickslip.agents.machine import Machine
from stickslip.agents.protocol import Env, Values
from stickslip.agents.training.configuration import Config
from stickslip.dynamics.plain_checks import require_choice, shown

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    from stickslip.agents.evaluation.evaluate import Measures
    from stickslip.agents.evaluation.standard import StandardEpisodes
    from stickslip.agents.machine import TrainingTask
    from stickslip.agents.protocol import AnyPlayer, Policy
    from stickslip.agents.tasks.standard import StandardTask
    from stickslip.agents.untrusted import Json


class StandardMachine(Machine[Env, Values, Config]):
    """A machine whose task is its environment and its parameters.

    To be said: the names of Machine without a value here, `env`, `with_scene` where there are
    scenes, `baseline` where there are any, and `training_task` where training differs from the
    standard task. The environment is a dataclass; its parameters are one, too, with `time_limit`
    and `control_period`, their classes stand in `modules`, and options that change a task have the
    names of their fields. Infos hold "episode_return" and "episode_length" (steps so far).
    """

    evaluated: ClassVar[tuple[str, ...]] = ("return", "duration", "failures")
    episode: ClassVar[tuple[str, ...]] = ("episodes", "return", "duration")
    film: ClassVar[str] = "episode.gif"
    frames: ClassVar[float] = 25.0

    @abstractmethod
    def env(self) -> Env:
        """The environment of the standard task, whose parameters are its `default_params`."""

    def with_scene(self, params: Values, scene: str) -> Values:
        """The parameters in a scene of `scenes`."""
        raise NotImplementedError(f"{type(self).__name__}.with_scene, which its scenes need")

    def in_scene(self, params: Values, scene: str) -> Values:
        """The parameters in a scene. ValueError for an unknown one."""
        if not self.scenes:
            raise ValueError(f"scene {shown(scene)}; accepted: none, the {self.title} has none")
        require_choice("scene", scene, self.scenes)
        return self.with_scene(params, scene)

    def describe(self, env: Env, params: Values) -> dict[str, Json]:
        """See Machine."""
        from stickslip.agents.tasks.file import task_entry

        return {"environment": type(env).__name__, **task_entry(env=env, values=params)}

    def read_task(self, metadata: Mapping[str, Json]) -> StandardTask[Env, Values] | None:
        """See Machine."""
        from stickslip.agents.tasks.standard import read_task

        return read_task(metadata, self.env(), self.in_scene)

    def standard_task(self, metadata: Mapping[str, Json]) -> StandardTask[Env, Values]:
        """See Machine."""
        from stickslip.agents.tasks.standard import StandardTask

        env = self.env()
        return StandardTask(env, env.default_params, self.in_scene)

    def baseline(self, name: str, env: Env) -> AnyPlayer:
        """See Machine."""
        raise ValueError(f"baseline {name!r} is unknown; accepted: none, the {self.title} has none")

    def measures(
        self, env: Env, *, task: bool = False, bound: bool = False
    ) -> Measures[object, Values, StandardEpisodes]:
        """See Machine."""
        self.require_no_bound(bound)
        from stickslip.agents.evaluation.standard import MEASURES

        return MEASURES

    def training_task(self, config: Config) -> StandardTask[Env, Values]:
        """See Machine."""
        return self.standard_task({})

    def evaluate_policy(
        self, task: TrainingTask[Env, Values], policy: Policy, config: Config
    ) -> dict[str, float]:
        """See Machine."""
        from stickslip.agents.evaluation.standard import evaluate_policy

        return evaluate_policy(task, policy, config.evaluation_episodes, self.evaluated)

    def summary(self, ended: Mapping[str, np.ndarray], period: float) -> dict[str, float]:
        """See Machine."""
        return {
            "episodes": len(ended["episode_return"]),
            "return": float(ended["episode_return"].mean()),
            "duration": float(ended["episode_length"].mean()) * period,
        }

    def beside_bar(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        return f"return {row.get('return', float('nan')):.2f}"

    def line(self, row: Mapping[str, float]) -> str:
        """See Machine."""
        return "  ".join(f"{name.replace('_', ' ')} {row[name]:8.3f}" for name in self.evaluated)
