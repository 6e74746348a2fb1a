"""What a policy earns in the environment itself, and what its value function says it would."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.run import play
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.statistics import fraction_interval, mean_interval
from stickslip.agents.protocol import Params, State

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Float

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.statistics import Interval
    from stickslip.agents.optimum.controller import ValuePolicy
    from stickslip.agents.optimum.state_map import StateMap
    from stickslip.agents.protocol import Player
    from stickslip.optim.dynamic_programming.grid import Grid


class Replay(NamedTuple):
    """Episodes under a controller, beside a value function; every entry [episodes]."""

    reward: np.ndarray
    """What the episode earned."""
    terminated: np.ndarray
    """Whether it ended otherwise than by the time limit."""
    expected: np.ndarray
    """What the grid says of the episode's start."""
    off_grid: np.ndarray
    """Share of the episode's states that the grid does not cover."""
    low: np.ndarray
    """Least coordinates on each sheet [episodes, sheets, rank]; infinite where it never was."""
    high: np.ndarray
    """Greatest ones."""
    start: object
    """The states that the episodes begin in."""

    @property
    def earned(self) -> Interval:
        """Mean return."""
        return mean_interval(self.reward)

    @property
    def falls(self) -> Interval:
        """Share of episodes that ended before their time."""
        return fraction_interval(self.terminated)


def replay(
    policy: ValuePolicy[State, Params],
    params: Params,
    seeds: Sequence[int],
    player: Player[State, Params] | None = None,
) -> Replay:
    """The seeds' episodes under the policy, or under another player beside its value function."""
    player = policy if player is None else player
    kept = play(policy.env, player, params, seeds, _Keep(policy.states, policy.grid))
    expected = expected_from(policy, kept.start, params)
    return Replay(
        reward=np.asarray(kept.reward),
        terminated=np.asarray(kept.terminated),
        expected=np.asarray(expected),
        off_grid=np.asarray(kept.off_grid),
        low=np.asarray(kept.low),
        high=np.asarray(kept.high),
        start=kept.start,
    )


def expected_from(
    policy: ValuePolicy[State, Params], starts: object, params: Params
) -> Float[Array, " episodes"]:
    """What the grid says of states [episodes] of the policy's environment."""
    return _expected(policy, jax.tree.map(jnp.asarray, starts), params)


@jax.jit
def _expected(policy: ValuePolicy[State, Params], starts: State, params: Params) -> Array:
    return jax.vmap(lambda start: policy.value(start, params))(starts)


class _Kept(NamedTuple):
    """See Replay."""

    reward: Array | np.ndarray
    terminated: Array | np.ndarray
    off_grid: Array | np.ndarray
    low: Array | np.ndarray
    high: Array | np.ndarray
    start: object


@dataclass(frozen=True)
class _Keep(Generic[State, Params]):
    """What is kept of an episode; static."""

    states: StateMap[State, Params]
    grid: Grid

    def __call__(self, played: Rollout[State], params: Params) -> _Kept:
        standard = keep_of(played, params)
        places = jax.vmap(lambda state: self.states.place(self.grid, state))(played.state)
        off = jax.vmap(lambda place: self.grid.cell(place).outside)(places)
        real = jnp.arange(len(played.reward)) < played.length
        on = real[:, None] & (places.sheet[:, None] == jnp.arange(len(self.grid.sheets)))
        on, at = on[..., None], places.coordinates[:, None, :]
        low = jnp.min(jnp.where(on, at, jnp.inf), 0)
        high = jnp.max(jnp.where(on, at, -jnp.inf), 0)
        share = jnp.sum(off & real) / played.length
        start = played.start_state
        return _Kept(standard.reward, standard.terminated, share, low, high, start)
