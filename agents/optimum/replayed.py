"""Returns of a policy in the environment, beside its value function's estimates."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.evaluate import require_room
from stickslip.agents.evaluation.rollout import episode_key, horizon, rollout
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.table import fraction_interval, mean_interval
from stickslip.agents.protocol import Params, Planner, State

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Float, PRNGKeyArray

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.table import Interval
    from stickslip.agents.optimum.controller import ValuePolicy
    from stickslip.agents.protocol import Player


class Replay(NamedTuple, Generic[State]):
    """Episodes under a controller, beside a value function; every entry [episodes]."""

    reward: Array | np.ndarray
    """Return of the episode."""
    terminated: Array | np.ndarray
    """True if it ended otherwise than by the time limit."""
    expected: Array | np.ndarray
    """Value of the episode's start on the grid."""
    off_grid: Array | np.ndarray
    """Share of the episode's states that the grid does not cover."""
    sheet: Array | np.ndarray
    """That each state is on [episodes, steps]; -1 after the episode's end."""
    coordinates: Array | np.ndarray
    """Of each state [episodes, steps, rank], see Place."""
    start: State
    """The states that the episodes begin in."""

    @property
    def earned(self) -> Interval:
        """Mean return."""
        return mean_interval(self.reward)

    @property
    def falls(self) -> Interval:
        """Share of episodes that ended before their time."""
        return fraction_interval(self.terminated)

    def extent(self, sheet: int) -> tuple[np.ndarray, np.ndarray] | None:
        """Least and greatest coordinates [rank] of the states on a sheet; None without any."""
        on = np.asarray(self.coordinates)[np.asarray(self.sheet) == sheet]
        return (on.min(0), on.max(0)) if len(on) else None


def replay(
    policy: ValuePolicy[State, Params],
    params: Params,
    seeds: Sequence[int],
    player: Player[State, Params] | None = None,
) -> Replay[State]:
    """The seeds' episodes under the policy, or under another controller beside its values.

    ValueError for a planner, which needs a plan for each episode.
    """
    player = policy if player is None else player
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    return jax.tree.map(np.asarray, _replay(count, player.validate(), policy, params, keys))


@jax.jit
def values_at(
    policy: ValuePolicy[State, Params], states: State, params: Params
) -> Float[Array, " n"]:
    """Values on the grid of states [n] of the policy's environment."""
    return jax.vmap(lambda state: policy.value(state, params))(states)


@partial(jax.jit, static_argnums=0)
def _replay(
    count: int,
    player: Player[State, Params],
    policy: ValuePolicy[State, Params],
    params: Params,
    keys: PRNGKeyArray,
) -> Replay[State]:
    if isinstance(player, Planner):
        raise ValueError(
            f"player is a {type(player).__name__}, which plans; accepted: a controller"
        )

    def one(key: PRNGKeyArray) -> Replay[State]:
        return _kept(policy, rollout(policy.env, player, params, key, count), params)

    return jax.vmap(one)(keys)


def _kept(
    policy: ValuePolicy[State, Params], played: Rollout[State], params: Params
) -> Replay[State]:
    """Kept data of an episode."""
    standard = keep_of(played, params)
    places = jax.vmap(policy.process(params).place)(played.state)
    off = jax.vmap(lambda place: policy.grid.cell(place).outside)(places)
    real = jnp.arange(len(played.reward)) < played.length
    return Replay(
        reward=standard.reward,
        terminated=standard.terminated,
        expected=policy.value(played.start_state, params),
        off_grid=jnp.sum(off & real) / played.length,
        sheet=jnp.where(real, places.sheet, -1),
        coordinates=places.coordinates,
        start=played.start_state,
    )
