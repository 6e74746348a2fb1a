"""Evaluations during training: on a named task with its scores, else the machine's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.agents.evaluation.evaluate import SCORES, TEST_SEEDS, is_random, play, scored
from stickslip.agents.evaluation.rollout import without_resets
from stickslip.agents.evaluation.table import INTERVALS, row_of_test
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.evaluation.evaluate import AnyMeasures
    from stickslip.agents.machine import AnyMachine, TrainingTask
    from stickslip.agents.protocol import AnyEnv, Policy, Timed
    from stickslip.agents.training.configuration import Configuration


def evaluation_columns(machine: AnyMachine, config: Configuration, env: AnyEnv) -> tuple[str, ...]:
    """Of evaluations.csv, after steps and seconds."""
    names = (
        machine.evaluated
        if config.task is None
        else _names(machine, _measures(machine, config, env))
    )
    ends = (f"{name}_{end}" for name in INTERVALS if name in names for end in ("low", "high"))
    return (*names, *ends)


def evaluation_row(
    machine: AnyMachine,
    task: TrainingTask[AnyEnv, Timed],
    policy: Policy,
    config: Configuration,
) -> dict[str, float]:
    """Row of an evaluation of a policy, by those columns.

    On a named task: over episodes from TEST_SEEDS on, which training never sees and neither the
    task's own scores nor those of `stickslip evaluate --task` are made of; one where a reset draws
    nothing.
    """
    if config.task is None:
        return machine.evaluate_policy(task, policy, config)
    measures = _measures(machine, config, task.env)
    count = config.evaluation_episodes if is_random(task.tested) else 1
    seeds = range(TEST_SEEDS, TEST_SEEDS + count)
    played = play(without_resets(task.env), policy, task.tested, seeds, measures.keep)
    return row_of_test(measures.columns, _names(machine, measures), played)


def evaluation_line(machine: AnyMachine, row: Mapping[str, float]) -> str:
    """An evaluation in a line."""
    score = f"score {row[SCORES[0]]:6.3f}  " if SCORES[0] in row else ""
    return score + machine.line(row)


def _measures(machine: AnyMachine, config: Configuration, env: AnyEnv) -> AnyMeasures:
    definition = task_by_name(str(config.task))
    measures, known = machine.measures(env, task=True), known_of(definition)
    return measures if known is None else scored(measures, known, definition.unit)


def _names(machine: AnyMachine, measures: AnyMeasures) -> tuple[str, ...]:
    """Those that scores have and the machine's own, in the order of a table."""
    return tuple(name for name in measures.columns if name in (*SCORES, *machine.evaluated))
