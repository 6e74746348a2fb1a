"""Interface between a run and what learns.

A trainer learns, reports, and gives out its policy and its state. Checkpoints, metrics,
evaluations, progress and resumption stand outside it and serve every trainer.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.configuration import Config
from stickslip.envs.rendering.extras import require

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.configuration import Configuration
    from stickslip.envs.functional import FunctionalEnv

TRAINERS = {
    "jax": "stickslip.agents.training.ppo:PPOTrainer",
    "jax, shac": "stickslip.agents.training.shac:SHACTrainer",
    "sb3": "stickslip.agents.training.sb3:SB3Trainer",
}
"""Module and class by name, or by name and algorithm where it has several; imported when used."""
ModelState: TypeAlias = "Mapping[str, np.ndarray | str | int]"
"""All that learning goes on from."""


class Update(NamedTuple):
    """Report of the learning since the last one."""

    timesteps: int
    """So far."""
    learning_rate: float
    noise: float
    """Standard deviation of exploration; NaN where there is no such number."""
    ended: Mapping[str, np.ndarray]
    """Last infos of the episodes that ended, each [episodes]; {} without any."""
    losses: Mapping[str, float]
    """By the names of `losses`; some may be missing."""


class Trainer(ABC, Generic[Config, State, Params]):
    """Something that learns a policy.

    From one `begin_stretch` to the next it depends on nothing but its state, the seed and the
    number of steps so far: so a run that was killed goes on as if it had not been.
    """

    losses: tuple[str, ...]
    """Columns of metrics.csv that are the trainer's own."""

    def __init__(
        self,
        config: Config,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
    ):
        """env, params: of training episodes. report: called after updates. stop: asked after every
        step, or every few that are one program; once true, learning ends and `stopped` is set.
        """
        self.config, self.env, self.params = config, env, params
        self.report, self.stop = report, stop
        self.timesteps = 0
        """So far; those of an update that `stop` cut short are not counted."""
        self.stopped = False

    @abstractmethod
    def begin_stretch(self, timesteps: int) -> None:
        """Restart all random generators and episodes that the state does not hold from the seed and
        the steps so far."""

    @abstractmethod
    def advance(self, goal: int) -> None:
        """Learn until there were at least `goal` steps in all, or until it is stopped."""

    @abstractmethod
    def take_state(self) -> ModelState:
        """All that learning goes on from."""

    @abstractmethod
    def put_state(self, state: ModelState) -> None:
        """Undo `take_state`. ValueError if the state does not fit the configuration."""

    @abstractmethod
    def policy(self) -> MLPPolicy:
        """The policy so far, without exploration."""

    @abstractmethod
    def is_finite(self) -> bool:
        """True if every parameter is."""

    def close(self) -> None:
        """Release what it holds."""


AnyTrainer: TypeAlias = Trainer[Any, Any, Any]


def trainer_of(config: Configuration) -> type[AnyTrainer]:
    """The trainer of a configuration. ModuleNotFoundError where a package is missing."""
    trainer = getattr(config, "trainer", "sb3")
    if trainer == "sb3":
        require("stable_baselines3", "the trainer sb3", "sb3")
    where = TRAINERS.get(f"{trainer}, {config.algorithm}", TRAINERS[trainer])
    module, _, name = where.partition(":")
    return getattr(import_module(module), name)
