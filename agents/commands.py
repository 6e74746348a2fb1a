"""What the commands of `stickslip` do, once their flags are read."""

from __future__ import annotations

import shlex
import time
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
from stickslip.agents.registry import machine_by_name, machine_of_env
from stickslip.agents.training.configuration import settings_given
from stickslip.dynamics.checks import require_integer
from stickslip.envs.tasks.definition import task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.optim.progress import say_stage
from stickslip.records.files import (
    require_folder,
    require_new,
    require_writable,
)
from stickslip.records.signals import stoppable
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
"""Of each in `stickslip evaluate`, unless it says otherwise."""


def train_command(given: Options) -> None:
    """`stickslip train`."""
    machine, out = machine_by_name(given["machine"]), given["out"]
    if given["resume"] and out is None:
        raise ValueError("--resume needs the run's directory; accepted: with --out DIR")
    changed = settings_given(given, machine.configuration)
    if given["resume"] and changed:
        names = ", ".join(changed)
        raise ValueError(
            f"--resume goes on with the run's own configuration; accepted: without {names}"
        )
    from stickslip.agents.training.run import best_evaluation, train

    config = None if given["resume"] else machine.configuration.of(**changed)
    algorithm = config.algorithm if config else ""
    whose = machine.name if config is None or config.task is None else config.task
    if out is not None:
        require_folder(out)
    directory = Path(out or f"runs/{whose}-{algorithm}-{time.strftime('%Y%m%d-%H%M%S')}")
    with stoppable() as stop:
        trained = train(config, directory, resume=given["resume"], stop=stop)
    machine, where = machine_by_name(trained.config.machine), shlex.quote(str(directory))
    if not trained.finished:
        again = f"stickslip train {machine.name} --out {where} --resume"
        raise stop.interrupted(f"Stopped after {trained.timesteps:,} steps; go on with: {again}")
    if not given["no_pictures"]:
        say_stage("drawing")
        from stickslip.agents.pictures.training import write_products

        write_products(trained)
    print(
        f"Trained {trained.timesteps:,} steps in {trained.seconds:.0f} s, evaluations aside; "
        f"all of it in {directory}"
    )
    on_task = ""
    if trained.config.task is not None:
        steps, earned = best_evaluation(trained.directory)
        task = task_by_name(trained.config.task)
        known = known_of(task)
        score = "" if known is None else f"score {known.scale.score(earned):.3f}, "
        best = f"{score}mean return {earned:.4g}{_unit(task)}"
        print(f"Best evaluation, after {steps:,} steps, over unseen episodes: {best}")
        print(task_in_words(trained.config.task))
        on_task = f" --task {trained.config.task}"
    print(f"Compare it: stickslip evaluate{on_task} {where} {' '.join(machine.baselines)}")


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
    """How much the episodes of each player amplify a small difference of their start."""
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
    table = evaluate_task(
        task, named, episodes=given["episodes"], progress=_running, bound=given["bound"]
    )
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
                name: controller_of(policies[name], name, env, place.params, machine)
                for name, own in place.who.items()
                if own == env
            }
            players += [
                (place.label, name, env, one, place.params) for name, one in controllers.items()
            ]
            parts.append((env, controllers, {place.label: place.params}))
    how = {"episodes": given["episodes"] or EPISODES, "progress": _running, "bound": given["bound"]}
    table = joined([evaluate(*part, **how) for part in parts], order=list(policies))
    return table, {place.label: place.line() for place in places}, players


def task_in_words(name: str) -> str:
    """Text of the task, and of what the scores 0 and 1 are."""
    task = task_by_name(name)
    known, unit = known_of(task), _unit(task)
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


def _unit(task: TaskDefinition) -> str:
    return "" if task.unit == "-" else f" {task.unit}"
