"""Batch evaluation of any machine: every controller in every scene over many seeds, vmapped."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from stickslip.agents.evaluation import rollout
from stickslip.agents.evaluation.table import Column, Evaluation, Measures, Row, Say
from stickslip.agents.machine import machine_by_name, machine_of_env
from stickslip.agents.protocol import Params, Player, State
from stickslip.envs.functional import AnyEnv, FunctionalEnv
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import OVER, UNKNOWN, Interval, Known, measured
from stickslip.records.table import with_unit

EPISODES = 32
SCORES = ("task_score", "gap")
"""Columns of a named task's scores."""


def evaluate(
    env: FunctionalEnv[State, Params],
    controllers: Mapping[str, Player[State, Params]],
    scenes: Mapping[str, Params],
    *,
    episodes: int = EPISODES,
    seeds: Sequence[int] | None = None,
    progress: Say | None = None,
) -> Evaluation:
    """Run every controller in every scene over the seeds (by default 0, 1, ..., episodes - 1).

    env: a BipedEnv, a UGVEnv or another machine's. controllers: by name (see Controller); the UGV's
    planners are among them. scenes: the environment's parameters, by name. Seed s is the first
    episode after `reset(seed=s)` of every adapter; where a reset draws nothing one episode is run.
    progress: called with a line before each row. ValueError for an environment of no machine.
    """
    measures, used = machine_of_env(env).measures(env), rollout.seeds_of(episodes, seeds)
    return _evaluated(env, controllers, scenes, measures, used, progress)


def evaluate_task(
    name: str,
    controllers: Mapping[str, Player],
    *,
    episodes: int | None = None,
    seeds: Sequence[int] | None = None,
    shield: float | None = None,
    program: str | None = None,
    progress: Say | None = None,
) -> Evaluation:
    """Run every controller on a named task's own episodes, with the columns task_score and gap.

    episodes: by default those that its best known score was measured on. On these, also on some of
    them, a score compares returns episode by episode, and its interval is of that; on others it
    compares means over different episodes. Where the task has a cost limit, a column has the mean
    cost, and who costs more is over the limit and has no score. shield, program: see `env_with`.
    ValueError for an unknown task.
    """
    task = task_by_name(name)
    env, params = task.make()
    env = env_with(env, shield, program)
    known, measures = measured(task.name), machine_by_name(task.machine).measures(env)
    used = rollout.seeds_of(known.episodes if episodes is None else episodes, seeds)
    measures = scored(measures, known, task.unit, used if rollout.is_random(env, params) else (0,))
    return _evaluated(env, controllers, {task.name: params}, measures, used, progress)


def env_with(env: AnyEnv, margin: float | None = None, program: str | None = None) -> AnyEnv:
    """The environment that applies safe torques alone, with this margin (see BipedEnv), and whose
    motion a program computes, "mujoco" (see Machine.moved_by); None: the environment as it is.
    ValueError for one without a shield or such a motion."""
    if margin is not None:
        if not hasattr(env, "shield"):
            raise ValueError(f"a shield for {type(env).__name__}; accepted: for BipedEnv")
        env = replace(env, shield=margin)  # pyright: ignore[reportArgumentType], a dataclass
    return env if program is None else machine_of_env(env).moved_by(env, program)


def scored(
    measures: Measures, known: Known, unit: str, seeds: Sequence[int] | None = None
) -> Measures:
    """The measures with the columns task_score and gap behind the return, and cost where there is a
    limit, over which there is neither score nor gap.

    unit: of the task's returns. seeds: of the episodes to come; None for others than the task's.
    """

    def within(statistic: Callable[..., Interval]) -> Callable[[Any], Interval]:
        def found(kept: Any) -> Interval:
            cost = None if measures.cost is None else measures.cost[1](kept).value
            return statistic(kept.reward, seeds) if known.keeps(cost) else Interval(UNKNOWN)

        return found

    score = Column("score", "-", 3, undefined=OVER), within(known.score)
    gap = Column("gap", unit, 2), within(known.gap)
    first = {"return": measures.columns["return"], **dict(zip(SCORES, (score, gap), strict=True))}
    if known.cost_limit is not None and measures.cost is not None:
        first["cost"] = measures.cost
    return replace(measures, columns=first | dict(measures.columns))


def _evaluated(
    env: AnyEnv,
    controllers: Mapping[str, Player],
    scenes: Mapping[str, Any],
    measures: Measures,
    seeds: tuple[int, ...],
    progress: Say | None,
) -> Evaluation:
    """Scenes of one structure share a compiled program for each kind of controller."""
    say = progress or (lambda line: None)
    rollout.require_places(env, scenes)
    rollout.require_named("controllers", controllers, "{name: controller}")
    named = {
        name: rollout.validated(f"controllers[{name!r}]", one) for name, one in controllers.items()
    }
    rows = []
    for scene, params in scenes.items():
        used = seeds if rollout.is_random(env, params) else seeds[:1]
        for name, controller in named.items():
            say(f"{name} on {scene}")
            kept = rollout.play(env, controller, params, used, measures.keep)
            metrics = {name: metric(kept) for name, (_, metric) in measures.columns.items()}
            rows.append(Row(scene, name, metrics, kept))
    return Evaluation(tuple(rows), seeds, measures.columns)


def task_in_words(name: str) -> str:
    """Text of the task, and of what the scores 0 and 1 are."""
    task = task_by_name(name)
    known, head = measured(name), task.headline
    if task.cost_limit is not None:
        head += f"\n  cost limit: {task.cost_limit:g}, of the mean over the episodes"
    trivial, best = (with_unit(one.value, task.unit, 4) for one in (known.trivial, known.best))
    return (
        f"{head}\n  score 0: {known.trivial.policy}, {trivial}; 1: the best known, {best}; how, "
        f"and what is proved: stickslip tasks {task.name}"
    )
