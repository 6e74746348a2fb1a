"""Episodes of every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, TypedDict

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.given import require_named, require_places, validated_player
from stickslip.agents.evaluation.rollout import (
    Rollout,
    episode_key,
    horizon,
    planned,
    rollout,
    without_resets,
)
from stickslip.agents.evaluation.table import Columns, Evaluation, Kept, Row
from stickslip.agents.protocol import Params, Params_contra, Planner, State, State_contra
from stickslip.dynamics.checks import require_integer, require_kind, require_memory

if TYPE_CHECKING:
    from collections.abc import Mapping

    from jaxtyping import PRNGKeyArray

    from stickslip.agents.evaluation.statistics import Interval
    from stickslip.agents.protocol import Controller, Player, Timed
    from stickslip.envs.functional import FunctionalEnv

Say: TypeAlias = Callable[[str], None]
Keep: TypeAlias = Callable[[Rollout[State], Params], Kept]
A_STEP = 300
"""Bytes that a step of an episode takes while episodes are played side by side."""
MOST_EPISODES = 65536
"""Of each controller in each scene."""


class How(TypedDict, total=False):
    """Episodes of an evaluation, and its progress callback."""

    episodes: int
    seeds: Sequence[int] | None
    progress: Say | None


@dataclass(frozen=True)
class Measures(Generic[State_contra, Params_contra, Kept]):
    """Kept data of an episode, and the metrics of it.

    keep: (rollout, parameters) -> a NamedTuple of numbers, traced; evaluations hold it with arrays
    [episodes]. It has `reward` and says which episodes ended outside the model, `fell`.
    complete: called with each scene, its parameters, the seeds and something to say a line with;
    what it returns is applied to all that is played there. None for nothing to add.
    """

    keep: Keep[State_contra, Params_contra, Kept]
    columns: Columns[Kept]
    complete: Callable[[str, Params_contra, Sequence[int], Say], Callable[[Kept], Kept]] | None = (
        None
    )

    def of(self, played: Kept) -> dict[str, Interval]:
        """Every metric of the episodes played."""
        return {name: metric(played) for name, (_, metric) in self.columns.items()}


def evaluate_in(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    measures: Measures[State, Params, Any],
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    progress: Say | None = None,
) -> Evaluation:
    """`stickslip.agents.evaluate` with given measures.

    Scenes of one structure share a compiled program for each kind of controller.
    """
    say = progress or (lambda line: None)
    require_places(env, scenes)
    require_named("controllers", controllers, "{name: controller}")
    named = {
        name: validated_player(f"controllers[{name!r}]", one) for name, one in controllers.items()
    }
    seeds = seeds_of(episodes, seeds, controllers=controllers, scenes=scenes)
    env = without_resets(env)
    rows = []
    for scene, params in scenes.items():
        used = seeds if is_random(params) else seeds[:1]
        add = None
        if measures.complete is not None:
            add = measures.complete(scene, params, used, say)
        for name, controller in named.items():
            say(f"{name} on {scene}")
            played = play(env, controller, params, used, measures.keep)
            played = played if add is None else add(played)
            rows.append(Row(scene, name, measures.of(played), played))
    return Evaluation(tuple(rows), seeds, measures.columns)


def seeds_of(
    episodes: int, seeds: Sequence[int] | None, **given: Mapping[str, object]
) -> tuple[int, ...]:
    """The seeds of an evaluation, by default 0, 1, ..., episodes - 1.

    ValueError if there are none, or if anything else given is empty.
    """
    if seeds is None:
        chosen: Iterable[object] = range(require_integer("episodes", episodes, high=MOST_EPISODES))
    else:
        require_kind("seeds", seeds, Iterable, "whole numbers >= 0 in a list")
        chosen = seeds
    found = tuple(require_integer("seeds", seed, low=0, high=2**32 - 1) for seed in chosen)
    for name, one in ({"seeds": found} | given).items():
        if not one:
            raise ValueError(f"{name} is empty; accepted: at least one")
    return found


def play(
    env: FunctionalEnv[State, Params],
    controller: Player[State, Params],
    params: Params,
    seeds: Sequence[int],
    keep: Keep[State, Params, Kept],
) -> Kept:
    """Run the seeds' episodes; kept data as NumPy arrays. A planner plans each of them."""
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    if isinstance(controller, Planner):
        paths = [planned(env, controller, params, seed) for seed in seeds]
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *paths)
        played = _play(env, count, keep, 0, stacked, params, keys)
    else:
        played = _play(env, count, keep, None, controller, params, keys)
    return jax.tree.map(np.asarray, played)


def require_room(episodes: int, steps: int) -> None:
    """Raise ValueError where so many episodes at once would not fit into memory."""
    require_memory(f"episodes = {episodes}", f"episodes of {steps} steps", episodes, steps * A_STEP)


def is_random(params: Timed) -> bool:
    """True if a reset draws anything; where nothing tells, it does."""
    return bool(jax.tree.leaves(getattr(params, "randomisation", True)))


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _play(
    env: FunctionalEnv[State, Params],
    count: int,
    keep: Keep[State, Params, Kept],
    axis: int | None,
    controller: Controller[Any, State, Params],
    params: Params,
    keys: PRNGKeyArray,
) -> Kept:
    def one(controller: Controller[Any, State, Params], key: PRNGKeyArray) -> Kept:
        return keep(rollout(env, controller, params, key, count), params)

    return jax.vmap(one, (axis, 0))(controller, keys)
