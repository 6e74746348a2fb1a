"""Trainers: the interface between a run and what learns.

A trainer learns, reports, and gives out its policy and its state. Checkpoints, metrics,
evaluations, progress and resumption stand outside it and serve every trainer.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.policy.network import MLPPolicy
from stickslip.agents.training.configuration import Configuration
from stickslip.dynamics.checks import shown
from stickslip.dynamics.pytrees import is_key
from stickslip.envs.functional import AnyEnv
from stickslip.envs.history import FrameStack

ModelState: TypeAlias = Mapping[str, np.ndarray | str | int]
"""All that learning goes on from."""
Tree = TypeVar("Tree")
UNFIT = "its contents do not fit the configuration"


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
    """Losses by the names of `losses`; some may be missing."""


class Trainer(ABC):
    """Something that learns a policy.

    From one `begin_stretch` to the next it depends on nothing but its state, the seed and the
    number of steps so far: so a run that was killed goes on as if it had not been.
    """

    losses: tuple[str, ...]
    """Columns of metrics.csv that are the trainer's own."""

    def __init__(
        self,
        config: Configuration,
        env: AnyEnv,
        params: Any,
        report: Callable[[Update], None] = lambda update: None,
        stop: Callable[[], bool] = lambda: False,
    ):
        """env, params: of training episodes. report: called after updates. stop: asked after every
        step, or every few that are one program; once true, learning ends and `stopped` is set.
        """
        self.config, self.params = config, params
        self.env = FrameStack(env, config.history) if config.history else env
        self.report, self.stop = report, stop
        self.timesteps = 0
        """So far; those of an update that `stop` cut short are not counted."""
        self.stopped = False
        self.build()

    @abstractmethod
    def build(self) -> None:
        """Make what learns, from nothing."""

    def begin_stretch(self) -> None:  # noqa: B027, nothing where the state holds all of them
        """Restart what the state does not hold, generators and episodes, from seed and steps."""

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
    def network(self) -> MLPPolicy:
        """The network so far, without exploration, of what `env` observes."""

    def policy(self) -> MLPPolicy:
        """The same as a policy of the environment without frames."""
        return replace(self.network(), history=self.config.history).validate()

    @abstractmethod
    def is_finite(self) -> bool:
        """True if every parameter is."""


def arrays_of(tree: object) -> dict[str, np.ndarray]:
    """A tree's arrays by their paths; random keys as plain numbers."""
    plain = jax.tree.map(lambda leaf: jax.random.key_data(leaf) if is_key(leaf) else leaf, tree)
    leaves = jax.tree.leaves_with_path(plain)
    return {jax.tree_util.keystr(path): np.asarray(leaf) for path, leaf in leaves}


def filled(tree: Tree, given: Mapping[str, object]) -> Tree:
    """The tree with the arrays that `arrays_of` gave. ValueError for those of another tree."""
    mine, leaves = arrays_of(tree), jax.tree.leaves(tree)
    if given.keys() != mine.keys():
        raise ValueError(f"{UNFIT} (it holds other arrays)")
    arrays = []
    for leaf, (name, own) in zip(leaves, mine.items(), strict=True):
        array = given[name]
        if not isinstance(array, np.ndarray) or _kind(array) != _kind(own):
            raise ValueError(f"{UNFIT} ({name} is {_kind(array)}, not {_kind(own)})")
        numbers = jnp.asarray(array)
        arrays.append(jax.random.wrap_key_data(numbers) if is_key(leaf) else numbers)
    return jax.tree.unflatten(jax.tree.structure(tree), arrays)


def _kind(value: object) -> str:
    return f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else shown(value)
