"""`stickslip evaluate`: policies and baselines in one table, on their own tasks or a named one."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from stickslip.agents.evaluation.evaluate import evaluate, evaluate_task
from stickslip.agents.evaluation.players import (
    common_task,
    controller_of,
    machine_of,
    named_on,
    places_of,
    read_named,
    require_one_table,
)
from stickslip.agents.evaluation.rollout import MOST_EPISODES, is_random
from stickslip.agents.evaluation.table import joined
from stickslip.agents.machine import machine_of_env
from stickslip.dynamics.checks import require_integer
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_folder, require_new, require_writable
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.protocol import AnyEnv, AnyPlayer, Options, Timed
    from stickslip.envs.tasks.definition import TaskDefinition

    Playing: TypeAlias = tuple[str, str, AnyEnv, AnyPlayer, Timed]
    """Scene, name, environment, player and parameters."""
    Played: TypeAlias = tuple[Evaluation, dict[str, str], list[Playing]]

EPISODES = 32
"""Default number of episodes of `stickslip evaluate`."""


def evaluate_command(given: Options) -> Content:
    """`stickslip evaluate`: print the tasks and the table, write the table if asked; return it."""
    if given["episodes"] is not None:
        require_integer("episodes", given["episodes"], high=MOST_EPISODES)
    targets = []
    if given["out"] is not None:
        require_folder(given["out"])
        targets = [Path(given["out"]) / f"evaluation.{kind}" for kind in ("csv", "json")]
    require_new(targets, given["overwrite"])

    task = common_task(given)
    play = _on_places if task is None else partial(_on_task, task)
    table, tasks, players = play(given, targets)
    tables = {"evaluation": table.as_table()}
    print("\n" + table.to_text())
    if given["amplification"]:
        tables["amplification"] = _amplification(players, table.seeds)
        print("\n" + tables["amplification"].terminal())
    if task is not None and given["episodes"] is None:
        print("\n" + measured_before(task))
    if targets:
        table.write_csv(targets[0])
        table.write_json(targets[1], {"tasks": tasks})
        print("Written: " + ", ".join(map(str, targets)))
    about = {"confidence": 0.95, "tasks": tasks, "files": list(map(str, targets))}
    return Content(tables, about)


def _amplification(players: Sequence[Playing], seeds: Sequence[int]) -> Table:
    """Amplification of a small difference of the start in the episodes of each player."""
    rows: list[list[object]] = []
    for place, name, env, player, params in players:
        _running(f"{name} on {place}, twice")
        used = seeds if is_random(params) else seeds[:1]
        found = machine_of_env(env).amplifications(env, player, params, used)
        median, most = (float(value) for value in np.quantile(found, [0.5, 1.0]))
        rows.append([place, name, len(found), median, most, int(np.sum(found > 1e3))])
    words = [Column(head, words=True) for head in ("scene", "controller")]
    numbers = [Column(f"{head}amplification") for head in ("median ", "largest ")]
    return Table([*words, Column("episodes"), *numbers, Column("above 1000")], rows)


def _running(line: str) -> None:
    say_stage(f"running {line}")


def _on_task(task: str, given: Options, written: Sequence[Path]) -> Played:
    """All on a named task."""
    named = named_on(task, given)
    require_writable(written)
    about = task_in_words(task)
    print(about)
    table = evaluate_task(task, named, episodes=given["episodes"], progress=_running)
    env, params = task_by_name(task).make()
    players = [(task, name, env, player, params) for name, player in named.items()]
    return table, {table.rows[0].scene: about}, players


def _on_places(given: Options, written: Sequence[Path]) -> Played:
    """Each on its own task, as flags change it; those of one environment in one program."""
    machine = machine_of(given["who"])
    policies = read_named(given["who"], machine)
    places = places_of(policies, given, machine)
    require_writable(written)
    require_one_table(places, machine)
    players: list[Playing] = []
    parts = []
    for place in places:
        print(place.line())
        for env in dict.fromkeys(place.who.values()):
            controllers = {
                name: controller_of(policies[name], name, env, machine)
                for name, own in place.who.items()
                if own == env
            }
            players += [
                (place.label, name, env, one, place.params) for name, one in controllers.items()
            ]
            parts.append((env, controllers, {place.label: place.params}))
    how = {"episodes": given["episodes"] or EPISODES, "progress": _running}
    table = joined([evaluate(*part, **how) for part in parts], order=list(policies))
    return table, {place.label: place.line() for place in places}, players


def task_in_words(name: str) -> str:
    """Text of the task, and of what the scores 0 and 1 are."""
    task = task_by_name(name)
    known, unit = known_of(task), unit_of(task)
    if known is None:
        return f"{task.headline}\n  nothing is known of it"
    return (
        f"{task.headline}\n  score 0: {known.trivial.policy}, {known.trivial.value:.4g}{unit}; "
        f"1: the best known, {known.best.value:.4g}{unit}; how, and what is proved: "
        f"stickslip tasks {task.name}"
    )


def measured_before(name: str) -> str:
    """Known scores of the task's own episodes, as a table."""
    task = task_by_name(name)
    known = known_of(task)
    if known is None:
        return "Nothing was measured on it before."
    words = [Column("controller", words=True), Column("score"), Column("return", task.unit)]
    everybody = (known.trivial, *known.baselines, *known.planners, known.best)
    rows = [
        [one.policy, known.score_of(one).shown(3), one.shown] for one in dict.fromkeys(everybody)
    ]
    return "Measured before on the same episodes:\n\n" + Table(words, rows).terminal()


def unit_of(task: TaskDefinition) -> str:
    """Unit of a task's returns, behind a number."""
    return "" if task.unit == "-" else f" {task.unit}"
