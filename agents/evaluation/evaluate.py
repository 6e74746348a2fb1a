"""Batch evaluation of any machine: every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.rollout import (
    Rollout,
    episode_key,
    horizon,
    planned,
    require_named,
    require_places,
    rollout,
    validated,
    without_resets,
)
from stickslip.agents.evaluation.table import Column, Columns, Evaluation, Kept, Row
from stickslip.agents.protocol import Params, Params_contra, Planner, State, State_contra
from stickslip.agents.registry import machine_by_name, machine_of_env
from stickslip.dynamics.checks import require_integer, require_kind, require_memory
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of

if TYPE_CHECKING:
    from jaxtyping import PRNGKeyArray

    from stickslip.agents.protocol import AnyPlayer, Controller, Player, Timed
    from stickslip.envs.functional import FunctionalEnv
    from stickslip.envs.tasks.known import Known

Say: TypeAlias = Callable[[str], None]
Keep: TypeAlias = Callable[[Rollout[State], Params], Kept]
STEP_BYTES = 300
"""Memory of a step of an episode while episodes are played side by side."""
MOST_EPISODES = 65536
"""Of each controller in each scene."""
EPISODES = 32
TEST_SEEDS = 2**31
"""Evaluations during training use the seeds from here on, so that none is seen in training."""
SCORES = ("task_score", "gap")
"""Columns of a named task's scores."""


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


AnyMeasures: TypeAlias = Measures[Any, Any, Any]
"""Of whichever machine."""


def evaluate(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    *,
    episodes: int = EPISODES,
    seeds: Sequence[int] | None = None,
    progress: Say | None = None,
    bound: bool = False,
) -> Evaluation:
    """Run every controller in every scene over the seeds (by default 0, 1, ..., episodes - 1).

    env: a BipedEnv, a UGVEnv or another machine's. controllers: by name (see Controller); the UGV's
    planners are among them. scenes: the environment's parameters, by name. Seed s is the first
    episode after `reset(seed=s)` of every adapter; where a reset draws nothing one episode is run.
    progress: called with a line before each row. bound: also what no policy can beat in each
    episode, proved (see `Machine.measures`; the UGV's take seconds to minutes an episode).
    ValueError for an environment of no machine, or of one without a bound.
    """
    measures = machine_of_env(env).measures(env, bound=bound)
    return _evaluated(env, controllers, scenes, measures, seeds_of(episodes, seeds), progress)


def evaluate_task(
    name: str,
    controllers: Mapping[str, AnyPlayer],
    *,
    episodes: int | None = None,
    seeds: Sequence[int] | None = None,
    progress: Say | None = None,
    bound: bool = False,
) -> Evaluation:
    """The same on a task of the ladder, by its name, with the columns task_score and gap.

    episodes: by default those that its best known score was measured on. On these, also on some of
    them, a score compares returns episode by episode, and its interval is of that; on others it
    compares means over different episodes. ValueError for an unknown task.
    """
    task = task_by_name(name)
    env, params = task.make()
    known = known_of(task)
    measures = machine_by_name(task.machine).measures(env, task=True, bound=bound)
    usual = EPISODES if known is None else known.episodes
    used = seeds_of(usual if episodes is None else episodes, seeds)
    if known is not None:
        measures = scored(measures, known, task.unit, used if is_random(params) else (0,))
    return _evaluated(env, controllers, {task.name: params}, measures, used, progress)


def scored(
    measures: AnyMeasures, known: Known, unit: str, seeds: Sequence[int] | None = None
) -> AnyMeasures:
    """The measures with the columns task_score and gap behind the return.

    unit: of the task's returns. seeds: of the episodes to come; None for others than the task's.
    """
    score = Column("score", "-", 3), lambda played: known.score(played.reward, seeds)
    gap = Column("gap", unit, 2), lambda played: known.gap(played.reward, seeds)
    first = {"return": measures.columns["return"], **dict(zip(SCORES, (score, gap), strict=True))}
    return replace(measures, columns=first | dict(measures.columns))


def _evaluated(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    measures: Measures[State, Params, Any],
    seeds: tuple[int, ...],
    progress: Say | None,
) -> Evaluation:
    """Scenes of one structure share a compiled program for each kind of controller."""
    say = progress or (lambda line: None)
    require_places(env, scenes)
    require_named("controllers", controllers, "{name: controller}")
    for name, given in {"controllers": controllers, "scenes": scenes}.items():
        if not given:
            raise ValueError(f"{name} is empty; accepted: at least one")
    named = {name: validated(f"controllers[{name!r}]", one) for name, one in controllers.items()}
    env = without_resets(env)
    rows = []
    for scene, params in scenes.items():
        used = seeds if is_random(params) else seeds[:1]
        complete = measures.complete
        add = None if complete is None else complete(scene, params, used, say)
        for name, controller in named.items():
            say(f"{name} on {scene}")
            played = play(env, controller, params, used, measures.keep)
            played = played if add is None else add(played)
            metrics = {name: metric(played) for name, (_, metric) in measures.columns.items()}
            rows.append(Row(scene, name, metrics, played))
    return Evaluation(tuple(rows), seeds, measures.columns)


def seeds_of(episodes: int, seeds: Sequence[int] | None) -> tuple[int, ...]:
    """The seeds of an evaluation, by default 0, 1, ..., episodes - 1. ValueError for none."""
    if seeds is None:
        return tuple(range(require_integer("episodes", episodes, high=MOST_EPISODES)))
    require_kind("seeds", seeds, Iterable, "whole numbers >= 0 in a list")
    found = tuple(require_integer("seeds", seed, low=0, high=2**32 - 1) for seed in seeds)
    if not found:
        raise ValueError("seeds is empty; accepted: at least one")
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
    axis = None
    if isinstance(controller, Planner):
        paths = [planned(env, controller, params, seed) for seed in seeds]
        controller, axis = jax.tree.map(lambda *leaves: jnp.stack(leaves), *paths), 0
    return jax.tree.map(np.asarray, _play(env, count, keep, axis, controller, params, keys))


def require_room(episodes: int, steps: int) -> None:
    """Raise ValueError where so many episodes at once would not fit into memory."""
    what = f"episodes of {steps} steps"
    require_memory(f"episodes = {episodes}", what, episodes, steps * STEP_BYTES)


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
