"""`stickslip evaluate`: policies and baselines in a table, methods in a ranking."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

from stickslip.agents.evaluation import evaluate, players, ranking, results, rollout
from stickslip.agents.evaluation.table import Evaluation, joined
from stickslip.agents.machine import machine_by_name
from stickslip.agents.protocol import Options
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.envs.tasks.definition import task_by_name
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_folder, require_new, require_writable, write_whole
from stickslip.records.table import Content

Who: TypeAlias = Mapping[str, players.Named]
Evaluated: TypeAlias = tuple[Evaluation, dict[str, str]]

ALL = "all"
"""The --task that ranks methods over all tasks."""
RANKING = ("ranking.md", "ranking.png")
"""Files of a ranking, beside those of its methods."""
CHANGES = ("episodes", "shield", "program")
"""Options that change the episodes of a task or who acts on them."""


def evaluate_command(given: Options) -> Content:
    """`stickslip evaluate`: print the tasks and the table, write the table if asked; return it."""
    if given["episodes"] is not None:
        require_integer("episodes", given["episodes"], high=rollout.MOST_EPISODES)
    task, out = given.get("task"), None if given["out"] is None else Path(given["out"])
    if out is not None:
        require_folder(out)
    if task == ALL:
        return rank(given, out)
    targets = [] if out is None else [out / f"evaluation.{kind}" for kind in ("csv", "json")]
    require_new(targets, given["overwrite"])

    named = players.read_named(given["who"], task and machine_by_name(task_by_name(task).machine))
    if (task := players.common_task(named, given)) is None:
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


def _on_task(task: str, named: Who, given: Options, written: Sequence[Path]) -> Evaluated:
    """All on a named task."""
    task = task_by_name(task).name
    players.require_unchanged(task, players.given_flags(given))
    who = players.players_on(task, named)
    require_writable(written)
    about = evaluate.task_in_words(task)
    print(about)
    how = {name: given[name] for name in CHANGES}
    table = evaluate.evaluate_task(task, who, **how, progress=_running)
    return table, {table.rows[0].scene: about}


def _on_places(named: Who, given: Options, written: Sequence[Path]) -> Evaluated:
    """Each on its own task, as flags change it; those of one environment in one program."""
    places = players.places_of(named, given)
    require_writable(written)
    unit_of = players.machine_of(named).unit_of
    if len(units := {unit_of(env) for place in places for env in place.who.values()}) > 1:
        raise ValueError(
            f"policies trained for {' and '.join(sorted(units))} in one table; accepted: policies "
            "of one criterion, --criterion, or one at a time"
        )
    parts = []
    for place in places:
        print(place.line())
        for env in dict.fromkeys(place.who.values()):
            mine = [name for name, its in place.who.items() if its == env]
            own = {name: named[name].player(env, place.params) for name in mine}
            env = evaluate.env_with(env, given["shield"], given["program"])
            parts.append((env, own, {place.label: place.params}))
    how = {"episodes": given["episodes"] or evaluate.EPISODES, "progress": _running}
    table = joined([evaluate.evaluate(*part, **how) for part in parts], order=list(named))
    return table, {place.label: place.line() for place in places}


def rank(given: Options, out: Path | None) -> Content:
    """Play every method's policies, each on its own task; print and write scores and aggregates."""
    changes = [f"--{name}" for name in CHANGES if given[name] is not None]
    players.require_unchanged(ALL, [*changes, *players.given_flags(given)])
    before = results.read_methods(given["who"])
    files = [] if out is None else [out / f"{one.name}{results.SUFFIX}" for one in before]
    if out is not None:
        require_writable([*files, *(out / name for name in RANKING)], given["overwrite"])
        require("matplotlib", "the picture of a ranking")
    methods = results.replay(before, say_stage)
    found, differ = ranking.comparisons(methods), list(results.differences(before, methods))
    tables, about = [ranking.score_table(methods)], ranking.common_tasks(found)
    tables += [ranking.aggregate_table(methods, found)] if found else []
    print("\n" + "\n".join(one.terminal(grouped=True) for one in tables))
    print(about, *differ, sep="\n")
    written: list[Path] = []
    if out is not None:
        written += map(results.write_results, methods, files)
        text = "\n".join([*(one.markdown() for one in tables), about]) + "\n"
        written.append(write_whole(out / RANKING[0], text))
        written += [ranking.draw_profiles(found, out / RANKING[1])] if found else []
        print("Written: " + ", ".join(map(str, written)))
    facts = {"aggregates": {one.machine: one.aggregates for one in found}, "methods": methods}
    facts |= {"differences": differ, "files": list(map(str, written))}
    return Content(facts=facts)
