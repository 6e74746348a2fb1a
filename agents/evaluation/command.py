"""`stickslip evaluate`: policies and baselines in one table, on their own tasks or a named one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from stickslip.agents.evaluation.evaluate import (
    EPISODES,
    env_with,
    evaluate,
    evaluate_task,
)
from stickslip.agents.evaluation.players import (
    common_task,
    machine_of,
    places_of,
    players_on,
    read_named,
    require_one_table,
)
from stickslip.agents.evaluation.rollout import MOST_EPISODES
from stickslip.agents.evaluation.table import joined
from stickslip.agents.machine import machine_by_name
from stickslip.dynamics.checks import require_integer
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_folder, require_new, require_writable
from stickslip.records.table import Content

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.evaluation.players import Named
    from stickslip.agents.evaluation.table import Evaluation
    from stickslip.agents.protocol import Options
    from stickslip.envs.tasks.definition import TaskDefinition

    Who: TypeAlias = Mapping[str, Named]
    Played: TypeAlias = tuple[Evaluation, dict[str, str]]


def evaluate_command(given: Options) -> Content:
    """`stickslip evaluate`: print the tasks and the table, write the table if asked; return it."""
    if given["episodes"] is not None:
        require_integer("episodes", given["episodes"], high=MOST_EPISODES)
    targets = []
    if given["out"] is not None:
        require_folder(given["out"])
        targets = [Path(given["out"]) / f"evaluation.{kind}" for kind in ("csv", "json")]
    require_new(targets, given["overwrite"])

    task = given.get("task")
    named = read_named(given["who"], task and machine_by_name(task_by_name(task).machine))
    if (task := common_task(named, given)) is None:
        table, tasks = _on_places(named, given, targets)
    else:
        table, tasks = _on_task(task, named, given, targets)
    print("\n" + table.to_text())
    if targets:
        table.write_csv(targets[0])
        table.write_json(targets[1], {"tasks": tasks})
        print("Written: " + ", ".join(map(str, targets)))
    about = {"confidence": 0.95, "tasks": tasks, "files": list(map(str, targets))}
    return Content({"evaluation": table.as_table()}, about)


def _running(line: str) -> None:
    say_stage(f"running {line}")


def _on_task(task: str, named: Who, given: Options, written: Sequence[Path]) -> Played:
    """All on a named task."""
    players = players_on(task, named, given)
    require_writable(written)
    about = task_in_words(task)
    print(about)
    how = {name: given[name] for name in ("episodes", "shield", "program")}
    table = evaluate_task(task, players, **how, progress=_running)
    return table, {table.rows[0].scene: about}


def _on_places(named: Who, given: Options, written: Sequence[Path]) -> Played:
    """Each on its own task, as flags change it; those of one environment in one program."""
    places = places_of(named, given)
    require_writable(written)
    require_one_table(places, machine_of(named))
    parts = []
    for place in places:
        print(place.line())
        for env in dict.fromkeys(place.who.values()):
            own = {
                name: named[name].player(env, place.params)
                for name, its in place.who.items()
                if its == env
            }
            env = env_with(env, given["shield"], given["program"])
            parts.append((env, own, {place.label: place.params}))
    how = {"episodes": given["episodes"] or EPISODES, "progress": _running}
    table = joined([evaluate(*part, **how) for part in parts], order=list(named))
    return table, {place.label: place.line() for place in places}


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


def unit_of(task: TaskDefinition) -> str:
    """Unit of a task's returns, behind a number."""
    return "" if task.unit == "-" else f" {task.unit}"
