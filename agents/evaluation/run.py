"""Episodes of every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import episode_key, first_state, horizon, rollout
from stickslip.agents.evaluation.table import Columns, Evaluation, Row
from stickslip.dynamics.checks import require_integer, require_memory

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stickslip.agents.evaluation.rollout import Rollout

A_STEP = 300
"""Bytes that a step of an episode takes while episodes are played side by side."""
MOST_EPISODES = 65536
"""Of each controller in each scene."""


@dataclass(frozen=True)
class Measures:
    """What is kept of an episode, and the metrics that are made of it.

    keep: (rollout, parameters) -> a NamedTuple of numbers, traced; evaluations hold it with arrays
    [episodes]. It has `reward` and says which episodes ended outside the model, `fell`.
    complete: called with each scene, its parameters, the seeds and something to say a line with;
    what it returns is applied to all that is played there. None for nothing to add.
    """

    keep: Callable[[Rollout, Any], Any]
    columns: Columns
    complete: Callable[..., Callable[[Any], Any]] | None = None

    def of(self, played: Any) -> dict[str, Any]:
        """Every metric of the episodes played."""
        return {name: metric(played) for name, (_, metric) in self.columns.items()}


def evaluate_in(
    env: Any,
    controllers: Mapping[str, Any],
    scenes: Mapping[str, Any],
    measures: Measures,
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """`stickslip.agents.evaluate` with given measures.

    Scenes of one structure share a compiled program for each kind of controller.
    """
    say = progress or (lambda line: None)
    seeds = seeds_of(episodes, seeds, controllers=controllers, scenes=scenes)
    env = replace(env, autoreset="disabled")
    rows = []
    for scene, params in scenes.items():
        used = seeds if is_random(params) else seeds[:1]
        add = None
        if measures.complete is not None:
            add = measures.complete(scene, params, used, say)
        for name, controller in controllers.items():
            say(f"{name} on {scene}")
            played = play(env, controller.validate(), params, used, measures.keep)
            played = played if add is None else add(played)
            rows.append(Row(scene, name, measures.of(played), played))
    return Evaluation(tuple(rows), seeds, measures.columns)


def seeds_of(
    episodes: int, seeds: Sequence[int] | None, **given: Mapping[str, Any]
) -> tuple[int, ...]:
    """The seeds of an evaluation, by default 0, 1, ..., episodes - 1.

    ValueError if there are none, or if anything else given is empty.
    """
    if seeds is None:
        seeds = range(require_integer("episodes", episodes, low=0, high=MOST_EPISODES))
    seeds = tuple(require_integer("seeds", seed, low=0, high=2**32 - 1) for seed in seeds)
    for name, one in ({"seeds": seeds} | given).items():
        if not one:
            raise ValueError(f"{name} is empty; accepted: at least one")
    return seeds


def play(
    env: Any,
    controller: Any,
    params: Any,
    seeds: Sequence[int],
    keep: Callable[[Rollout, Any], Any],
) -> Any:
    """What is kept of the seeds' episodes, as NumPy arrays. A planner plans each of them."""
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    if not hasattr(controller, "path"):
        played = _play(env, count, keep, None, controller, params, keys)
    else:
        paths = [controller.path(env, params, first_state(env, params, seed)) for seed in seeds]
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *paths)
        played = _play(env, count, keep, 0, stacked, params, keys)
    return jax.tree.map(np.asarray, played)


def require_room(episodes: int, steps: int) -> None:
    """Raise ValueError where so many episodes at once would not fit into memory."""
    require_memory(f"episodes = {episodes}", f"episodes of {steps} steps", episodes, steps * A_STEP)


def is_random(params: Any) -> bool:
    """Whether a reset draws anything; where nothing tells, it does."""
    return not hasattr(params, "randomisation") or bool(jax.tree.leaves(params.randomisation))


@partial(jax.jit, static_argnums=(0, 1, 2, 3))
def _play(env, count: int, keep, axis: int | None, controller, params, keys) -> Any:
    def one(controller, key):
        return keep(rollout(env, controller, params, key, count), params)

    return jax.vmap(one, (axis, 0))(controller, keys)
