"""Replay of a value function's policy, and the bounds and estimate of the best return."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import (
    episode_key,
    horizon,
    require_room,
    rollout,
    seeds_of,
)
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.evaluation.table import fraction_interval, mean_interval
from stickslip.agents.protocol import Params, Planner, State
from stickslip.dynamics.checks import require_number

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Float, PRNGKeyArray

    from stickslip.agents.evaluation.table import Interval
    from stickslip.agents.optimum.policy import ValuePolicy
    from stickslip.agents.optimum.solution import Solution
    from stickslip.agents.protocol import Controller, Player

TOLERANCE = 0.02
"""Share of the highest return by which an estimate may differ from what its policy earns."""


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
    if isinstance(player, Planner):
        raise ValueError(
            f"player is a {type(player).__name__}, which plans; accepted: a controller"
        )
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    return jax.tree.map(np.asarray, _replay(count, player.validate(), policy, params, keys))


@partial(jax.jit, static_argnums=0)
def _replay(
    count: int,
    player: Controller[Any, State, Params],
    policy: ValuePolicy[State, Params],
    params: Params,
    keys: PRNGKeyArray,
) -> Replay[State]:
    def one(key: PRNGKeyArray) -> Replay[State]:
        played = rollout(policy.env, player, params, key, count)
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

    earned: the policy's own mean return, replayed in the environment: a lower bound of the optimum
    over these episodes, since there is a policy that earns it; over all starts its interval holds.
    upper_bound: no policy earns more over any episodes, by the reward's definition. estimate: what
    the grid says of the same starts, which bounds nothing. coarser: the same of a grid with half
    the cells, None where none was solved. falls: share of episodes that ended before their time.
    off_grid: share of all states that the grid does not cover; there its nearest node was asked.
    tolerance: see `holds`.
    """

    earned: Interval
    upper_bound: float
    estimate: float
    coarser: float | None
    falls: Interval
    off_grid: float
    tolerance: float
    replay: Replay

    @property
    def lower_bound(self) -> float:
        """Of the optimum over these episodes."""
        return self.earned.value

    @property
    def refinement(self) -> float | None:
        """By how much the estimate changed when the cells were halved."""
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
        spread = f" ({low:.2f} to {high:.2f} for the mean over all starts)"
        words = [
            f"proved: the optimum over these {len(self.replay.reward)} episodes is at least "
            f"{self.earned.value:.3f}{spread if np.isfinite(low) else ''}, which the policy earns, "
            f"and at most {self.upper_bound:.3f}"
        ]
        finer = "" if self.refinement is None else f", {self.refinement:.3f} from half the cells'"
        if self.holds:
            words.append(f"estimated: {self.estimate:.3f}, the grid's value{finer}")
        else:
            words.append(
                f"not known: the grid says {self.estimate:.3f}{finer}, but its policy does not "
                "earn that"
            )
        words.append(f"{self.falls.value:.0%} of the episodes end before their time")
        if self.off_grid:
            words.append(f"{self.off_grid:.2%} of the states lie off the grid")
        return "; ".join(words)


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
    policy, params = solution.policy, solution.params
    for one in (solution, coarser):
        if one is not None and one.values.sweeps != horizon(params):
            raise ValueError(
                f"a solution of {one.values.sweeps} steps; accepted: of {horizon(params)}, those "
                "of an episode"
            )
    played = replay(policy, params, seeds_of(episodes, seeds))
    before = None
    if coarser is not None:
        before = float(np.mean(np.asarray(_values_at(coarser.policy, played.start, params))))
    return Known(
        earned=played.earned,
        upper_bound=policy.states.most(params) * horizon(params),
        estimate=float(np.mean(played.expected)),
        coarser=before,
        falls=played.falls,
        off_grid=float(np.mean(played.off_grid)),
        tolerance=float(tolerance),
        replay=played,
    )


@jax.jit
def _values_at(
    policy: ValuePolicy[State, Params], states: State, params: Params
) -> Float[Array, " n"]:
    """Values on the grid of states [n] of the policy's environment."""
    return jax.vmap(lambda state: policy.value(state, params))(states)
