"""The seam between a run and what learns.

A trainer learns, says how it goes, and gives out its policy and its state. All else stands outside
it and serves every trainer: checkpoints, metrics, TensorBoard, evaluations, progress, resumption,
what is drawn at the end.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeAlias

from stickslip.agents.protocol import Params, State
from stickslip.agents.training.configuration import Config

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

    from stickslip.agents.policy.network import MLPPolicy
    from stickslip.agents.training.checkpoint import ModelState
    from stickslip.agents.training.configuration import Configuration
    from stickslip.envs.functional import FunctionalEnv


TRAINERS = {
    "jax": "stickslip.agents.training.ppo.trainer:PPOTrainer",
    "jax, shac": "stickslip.agents.training.shac.trainer:SHACTrainer",
    "sb3": "stickslip.agents.training.sb3.trainer:SB3Trainer",
}
"""Module and class by name, or by name and algorithm where it has several; what they import is
needed only where they are used."""


class Update(NamedTuple):
    """How learning went since the update that was reported last."""

    timesteps: int
    """So far."""
    learning_rate: float
    noise: float
    """Standard deviation of exploration; NaN where there is no such number."""
    ended: Mapping[str, np.ndarray]
    """What the last infos of the episodes that ended held, each [episodes]; {} without any."""
    losses: Mapping[str, float]
    """By the names of `losses`; what is not known may be missing."""


class Trainer(ABC, Generic[Config, State, Params]):
    """Something that learns a policy.

    What it does from one `begin_stretch` to the next depends on nothing but its state, the seed
    and the number of steps so far: so a run that was killed goes on as if it had not been.
    """

    def __init__(
        self,
        config: Config,
        env: FunctionalEnv[State, Params],
        params: Params,
        report: Callable[[Update], None],
        stop: Callable[[], bool],
        devices: int | None = None,
    ):
        """config: the machine's. env, params: of training episodes. devices: for a trainer that
        learns on several; default: all that divide the environments evenly.

        report: to be called after updates. stop: to be asked after every step, or every few that
        are one program; once true, learning ends and `stopped` is set.
        """
        self.config, self.env, self.params = config, env, params
        self.report, self.stop, self.devices = report, stop, devices
        self.timesteps = 0
        """So far; those of an update that `stop` cut short are not counted."""
        self.stopped = False

    @property
    @abstractmethod
    def losses(self) -> tuple[str, ...]:
        """Columns of metrics.csv that are the trainer's own."""

    @abstractmethod
    def begin_stretch(self, timesteps: int) -> None:
        """Start all random generators and episodes anew from the seed and the steps so far, but for
        those that the state holds."""

    @abstractmethod
    def advance(self, goal: int) -> None:
        """Learn until there were at least `goal` steps in all, or until it is stopped."""

    @abstractmethod
    def take_state(self) -> ModelState:
        """All that learning goes on from: NumPy arrays, numbers and texts in dictionaries, lists
        and tuples."""

    @abstractmethod
    def put_state(self, state: ModelState) -> None:
        """Undo `take_state`. ValueError if the state does not fit the configuration."""

    @abstractmethod
    def policy(self) -> MLPPolicy:
        """What was learnt so far, without exploration."""

    @abstractmethod
    def is_finite(self) -> bool:
        """Whether every parameter is."""

    @abstractmethod
    def close(self) -> None:
        """Let go of what it holds."""


AnyTrainer: TypeAlias = Trainer[Any, Any, Any]
"""Of whatever learns, on whichever machine."""


def trainer_of(config: Configuration) -> type[AnyTrainer]:
    """The trainer that a configuration asks for. ModuleNotFoundError where a package is missing."""
    trainer = getattr(config, "trainer", "sb3")
    where = TRAINERS.get(f"{trainer}, {config.algorithm}", TRAINERS[trainer])
    module, _, name = where.partition(":")
    kind = getattr(import_module(module), name)
    if not issubclass(kind, Trainer):
        raise TypeError(f"{kind} is no Trainer")
    return kind
