"""Dynamic programming for an environment: a value function, its policy, and bounds by replay."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import (
    episode_key,
    horizon,
    require_room,
    rollout,
    seeds_of,
    without_resets,
)
from stickslip.agents.evaluation.table import fraction_interval, keep_of, mean_interval
from stickslip.agents.machine import machine_of_env
from stickslip.agents.optimum.grid import Grid
from stickslip.agents.optimum.policy import Ahead, EnvProcess, StateMap, ValuePolicy
from stickslip.agents.optimum.value_iteration import finite_horizon, transitions
from stickslip.agents.protocol import Params, State
from stickslip.dynamics.checks import require_integer, require_kind, require_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, PRNGKeyArray

    from stickslip.agents.evaluation.table import Interval
    from stickslip.envs.functional import FunctionalEnv

TOLERANCE = 0.02
"""Share of the highest return by which an estimate may differ from what its policy earns."""


@dataclass(frozen=True)
class Solution(Generic[State, Params]):
    """A value function and its policy.

    policy.values: the most that can be earned from each node in an episode's steps, on the grid;
    not proved for the environment: `known` replays the policy.
    """

    policy: ValuePolicy[State, Params]
    params: Params


def solve(
    env: FunctionalEnv[State, Params],
    params: Params,
    *,
    grid: Grid | None = None,
    fineness: float = 1.0,
    actions: int = 41,
    ahead: Ahead | None = None,
    states: StateMap[State, Params] | None = None,
    progress: bool = False,
) -> Solution[State, Params]:
    """The value function of a task, by dynamic programming on the environment's own step.

    grid: nodes, default: the machine's usual grid with `fineness` times as many cells along each
    axis. actions: so many torques (or what the action is), evenly from -1 to 1. ahead: how far the
    policy looks. states: the state's coordinates, default: the machine's.

    ValueError for a task whose rewards depend on more than the coordinates, and for a grid that
    memory does not hold.
    """
    env.check_params(params)
    env = without_resets(env)
    actions = require_integer("actions", actions, low=2, high=10**4)
    require_kind("ahead", ahead, (Ahead, type(None)), "an Ahead or None")
    states = machine_of_env(env).state_map(env, params) if states is None else states
    grid = states.grid(params, fineness) if grid is None else grid
    require_kind("grid", grid, Grid, "a Grid")
    grid.validate()
    start = env.reset(episode_key(0), params)[1]
    kind = jax.eval_shape(lambda one: states.place(grid, one).coordinates, start).dtype
    tried = jnp.linspace(-1.0, 1.0, actions, dtype=kind)[:, None]
    process, outside = EnvProcess(params, tried, grid, env, states), states.leaving(params)
    table = transitions(process, outside, progress=progress)
    values = finite_horizon(table, horizon(params), progress=progress)
    policy = ValuePolicy(values, tried, outside, grid, env, states, ahead or Ahead())
    return Solution(policy.validate(), params)


class Replay(NamedTuple, Generic[State]):
    """Episodes of a value function's policy; every entry [episodes]."""

    reward: Array | np.ndarray
    """Return of the episode."""
    terminated: Array | np.ndarray
    """True if it ended otherwise than by the time limit."""
    expected: Array | np.ndarray
    """Value of the episode's start on the grid."""
    off_grid: Array | np.ndarray
    """Share of the episode's states that the grid does not cover."""
    start: State
    """The states that the episodes begin in."""


def replay(
    policy: ValuePolicy[State, Params], params: Params, seeds: Sequence[int]
) -> Replay[State]:
    """The seeds' episodes under the policy."""
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    return jax.tree.map(np.asarray, _replay(count, policy.validate(), params, keys))


@partial(jax.jit, static_argnums=0)
def _replay(
    count: int, policy: ValuePolicy[State, Params], params: Params, keys: PRNGKeyArray
) -> Replay[State]:
    def one(key: PRNGKeyArray) -> Replay[State]:
        played = rollout(policy.env, policy, params, key, count)
        standard = keep_of(played, params)
        place = policy.process(params).place
        off = jax.vmap(lambda state: policy.grid.cell(place(state)).outside)(played.state)
        real = jnp.arange(len(played.reward)) < played.length
        return Replay(
            reward=standard.reward,
            terminated=standard.terminated,
            expected=policy.value(played.start_state, params),
            off_grid=jnp.sum(off & real) / played.length,
            start=played.start_state,
        )

    return jax.vmap(one)(keys)


@dataclass(frozen=True)
class Known:
    """Bounds and estimate of the best policy's mean return over the same episodes.

    upper_bound: no policy earns more over any episodes, by the reward's definition. tolerance: see
    `holds`.
    """

    replay: Replay
    upper_bound: float
    tolerance: float

    @property
    def earned(self) -> Interval:
        """The policy's mean return, replayed in the environment: a lower bound of the optimum over
        these episodes, since there is a policy that earns it; over all starts its interval holds.
        """
        return mean_interval(self.replay.reward)

    @property
    def lower_bound(self) -> float:
        """Lower bound on the optimum over these episodes."""
        return self.earned.value

    @property
    def falls(self) -> Interval:
        """Share of episodes that ended before their time."""
        return fraction_interval(self.replay.terminated)

    @property
    def estimate(self) -> float:
        """The grid's value of the same starts, which bounds nothing."""
        return float(np.mean(self.replay.expected))

    @property
    def off_grid(self) -> float:
        """Share of all states that the grid does not cover; there its nearest node was asked."""
        return float(np.mean(self.replay.off_grid))

    @property
    def holds(self) -> bool:
        """True if the policy earns what the grid says, within `tolerance` of the upper bound, and
        stays where the grid knows something. Only then is the estimate worth a mention."""
        off = abs(self.estimate - self.earned.value)
        return off <= self.tolerance * abs(self.upper_bound) and self.off_grid == 0


def known(
    solution: Solution[State, Params],
    *,
    episodes: int = 48,
    seeds: Sequence[int] | None = None,
    tolerance: float = TOLERANCE,
) -> Known:
    """Replay a solution's policy over episodes of its own task, seeds 0, 1, ... unless given."""
    require_number("tolerance", tolerance, low=0.0, accepted="finite, >= 0")
    played = replay(solution.policy, solution.params, seeds_of(episodes, seeds))
    most = solution.policy.states.most(solution.params) * horizon(solution.params)
    return Known(played, most, float(tolerance))
