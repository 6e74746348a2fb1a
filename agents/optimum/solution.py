"""Dynamic programming for an environment: a value function, its policy, and bounds by replay."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
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
from stickslip.agents.optimum.file import Checkpoint, digest_of
from stickslip.agents.optimum.grid import Grid
from stickslip.agents.optimum.policy import Ahead, EnvProcess, StateMap, ValuePolicy
from stickslip.agents.optimum.value_iteration import Counts, Values, finite_horizon, transitions
from stickslip.agents.protocol import Params, State
from stickslip.dynamics.checks import require_integer, require_kind, require_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Float, PRNGKeyArray

    from stickslip.agents.evaluation.table import Interval
    from stickslip.envs.functional import FunctionalEnv

TOLERANCE = 0.02
"""Share of the highest return by which an estimate may differ from what its policy earns."""


@dataclass(frozen=True)
class Solution(Generic[State, Params]):
    """A value function and its policy.

    values.value: the most that can be earned from a node in `values.sweeps` steps, on the grid.
    counts: of the transitions. None of it is proved for the environment: `known` replays the
    policy.
    """

    policy: ValuePolicy[State, Params]
    params: Params
    values: Values
    counts: Counts


def solve(
    env: FunctionalEnv[State, Params],
    params: Params,
    *,
    grid: Grid | None = None,
    fineness: float = 1.0,
    actions: int = 41,
    steps: int | None = None,
    ahead: Ahead | None = None,
    states: StateMap[State, Params] | None = None,
    checkpoint: str | Path | None = None,
    progress: bool = False,
) -> Solution[State, Params]:
    """The value function of a task, by dynamic programming on the environment's own step.

    grid: nodes, default: the machine's usual grid with `fineness` times as many cells along each
    axis. actions: so many torques (or what the action is), evenly from -1 to 1. steps: of the
    return that is maximised, default: an episode. ahead: how far the policy looks. states: the
    state's coordinates, default: the machine's. checkpoint: a file to keep the values in every few
    sweeps, and to resume from where it is there.

    ValueError for a task whose rewards depend on more than the coordinates, for a grid that memory
    does not hold, and for a checkpoint of another definition.
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
    steps = horizon(params) if steps is None else require_integer("steps", steps)
    before, report = None, None
    if checkpoint is not None:
        # The sweeps of an episode are those of a longer one, too: `steps` is no part of this.
        what = version("stickslip"), repr((env, states)), outside
        kept = Checkpoint(Path(checkpoint), digest_of(*what, params, grid, tried), grid.size)
        before, report = kept.read(), kept.write
    if before is not None and before.sweeps > steps:
        raise ValueError(
            f"{checkpoint} holds {before.sweeps} sweeps; accepted: at most steps = {steps}"
        )
    table = transitions(process, outside, progress=progress)
    values = finite_horizon(table, steps, start=before, report=report, progress=progress)
    policy = ValuePolicy(values.value, tried, outside, grid, env, states, ahead or Ahead())
    return Solution(policy.validate(), params, values, table.counts)


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


@jax.jit
def _values_at(
    policy: ValuePolicy[State, Params], states: State, params: Params
) -> Float[Array, " n"]:
    """Values on the grid of states [n] of the policy's environment."""
    return jax.vmap(lambda state: policy.value(state, params))(states)


@dataclass(frozen=True)
class Known:
    """Bounds and estimate of the best policy's mean return over the same episodes.

    upper_bound: no policy earns more over any episodes, by the reward's definition. coarser: the
    estimate of a grid with half the cells, None where none was solved. tolerance: see `holds`.
    """

    replay: Replay
    upper_bound: float
    coarser: float | None
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
    def refinement(self) -> float | None:
        """Change of the estimate when the cells were halved."""
        return None if self.coarser is None else abs(self.estimate - self.coarser)

    @property
    def holds(self) -> bool:
        """True if the policy earns what the grid says, within `tolerance` of the upper bound, and
        stays where the grid knows something. Only then is the estimate worth a mention."""
        off = abs(self.estimate - self.earned.value)
        return off <= self.tolerance * abs(self.upper_bound) and self.off_grid == 0

    def in_words(self) -> str:
        """Text of what is proved, estimated and not known."""
        low, high = self.earned.low, self.earned.high
        finer = "" if self.refinement is None else f", {self.refinement:.3f} from half the cells'"
        guess = f"{self.estimate:.3f}{finer}"
        return "; ".join(
            [
                f"proved: the optimum over these {len(self.replay.reward)} episodes is at least "
                f"{self.earned.value:.3f}, which the policy earns ({low:.2f} to {high:.2f} for the "
                f"mean over all starts), and at most {self.upper_bound:.3f}",
                f"estimated: {guess}, the grid's value"
                if self.holds
                else f"not known: the grid says {guess}, but its policy does not earn that",
                f"{self.falls.value:.0%} of the episodes end before their time",
                f"{self.off_grid:.2%} of the states lie off the grid",
            ]
        )


def known(
    solution: Solution[State, Params],
    *,
    coarser: Solution[State, Params] | None = None,
    episodes: int = 48,
    seeds: Sequence[int] | None = None,
    tolerance: float = TOLERANCE,
) -> Known:
    """Replay a solution's policy over episodes of its own task, seeds 0, 1, ... unless given.

    coarser: a solution on a grid with half the cells, for the error of the estimate. ValueError
    for a solution of other steps than an episode's.
    """
    require_number("tolerance", tolerance, low=0.0, accepted="finite, >= 0")
    params, steps = solution.params, horizon(solution.params)
    for one in (solution, coarser):
        if one is not None and one.values.sweeps != steps:
            raise ValueError(
                f"a solution of {one.values.sweeps} steps; accepted: of {steps}, those of an "
                "episode"
            )
    played = replay(solution.policy, params, seeds_of(episodes, seeds))
    before = None
    if coarser is not None:
        before = float(np.mean(np.asarray(_values_at(coarser.policy, played.start, params))))
    most = solution.policy.states.most(params) * steps
    return Known(played, most, before, float(tolerance))
