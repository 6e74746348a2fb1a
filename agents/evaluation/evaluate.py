"""Batch evaluation of any machine: every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.run import evaluate_in, is_random, seeds_of
from stickslip.agents.evaluation.scored import scored
from stickslip.agents.registry import machine_by_name, machine_of_env
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.protocol import AnyPlayer, Params, Player, State
    from stickslip.envs.functional import FunctionalEnv


def evaluate(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    progress: Callable[[str], None] | None = None,
    bound: bool = False,
) -> Evaluation:
    """Run every controller in every scene over the seeds (by default 0, 1, ..., episodes - 1).

    env: a BipedEnv, a UGVEnv or another machine's. controllers: by name (see Controller); the UGV's
    planners are among them. scenes: the environment's parameters, by name. Seed s is the first
    episode after `reset(seed=s)` of every adapter; where a reset draws nothing one episode is run.
    progress: called with a line before each row. bound: also what no policy can beat in each
    episode, proved (see `Machine.bounded`; the UGV's take seconds to minutes an episode).
    ValueError for an environment of no machine, or of one without a bound.
    """
    machine = machine_of_env(env)
    measures = machine.measures(env)
    if bound:
        measures = machine.bounded(env, measures)
    return evaluate_in(
        env, controllers, scenes, measures, episodes=episodes, seeds=seeds, progress=progress
    )


def evaluate_task(
    name: str,
    controllers: Mapping[str, AnyPlayer],
    *,
    episodes: int | None = None,
    seeds: Sequence[int] | None = None,
    progress: Callable[[str], None] | None = None,
    bound: bool = False,
) -> Evaluation:
    """The same on a task of the ladder, by its name, with the columns task_score and gap.

    episodes: by default those that its best known score was measured on. On these, also on some of
    them, a score compares returns episode by episode, and its interval is of that; on others it
    compares means over different episodes. ValueError for an unknown task.
    """
    task = task_by_name(name)
    env, params = task.make()
    env, known = without_resets(env), known_of(task)
    machine = machine_by_name(task.machine)
    measures = machine.task_measures(env)
    if bound:
        measures = machine.bounded(env, measures)
    usual = 32 if known is None else known.episodes
    count = usual if episodes is None else episodes
    if known is not None:
        played = seeds_of(count, seeds) if is_random(params) else (0,)
        measures = scored(measures, known, task.unit, played)
    return evaluate_in(
        env,
        controllers,
        {task.name: params},
        measures,
        episodes=count,
        seeds=seeds,
        progress=progress,
    )
