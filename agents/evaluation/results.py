"""Results of methods on the named tasks: read from runs and files, replayed, written."""

import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.agents import untrusted
from stickslip.agents.evaluation.evaluate import evaluate_task
from stickslip.agents.evaluation.players import Named, players_on, read_named
from stickslip.agents.machine import machine_by_name, machine_of_baseline
from stickslip.agents.policy.file import named_task_of, policy_path
from stickslip.agents.policy.shipped import shipped_path
from stickslip.agents.training import directory as runs
from stickslip.dynamics.checks import require_that, reraise, shown
from stickslip.envs.tasks.definition import TASKS, task_by_name
from stickslip.envs.tasks.known import UNKNOWN, Interval, episodes_digest, measured
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

FORMAT, VERSION = "stickslip results", 1
ACCEPTED = "a file of results as `stickslip evaluate --task all WHO ... --out DIR` writes it"
SUFFIX = ".json"
METHOD_NAME = re.compile(r"[\w+. -]{1,64}", re.ASCII)
MOST_RESULTS = 10_000
RULES = {
    "task": untrusted.Rule(str, "name"),
    "episodes": untrusted.Rule(str, "`test_episodes` of `stickslip tasks NAME`"),
    "seed": untrusted.Rule(int, "of the training", low=0, optional=True),
    "cost": untrusted.Rule(float, "mean of an episode", low=0, optional=True),
    "failures": untrusted.Rule(float, "share of the episodes", low=0, high=1, optional=True),
    "steps": untrusted.Rule(int, "of the training", low=0, optional=True),
    "seconds": untrusted.Rule(float, "of the training, wall clock", low=0, optional=True),
    "processor_seconds": untrusted.Rule(float, "of the training", low=0, optional=True),
    "policy": untrusted.Rule(str, "its file", optional=True),
}
HEAD = {"method": untrusted.Rule(str, "its name"), "about": untrusted.Rule(str, "in a sentence")}
"""Rules of the entries of a result, besides its returns, and of a file, besides its results."""
ROUNDING = 1e-3
"""Relative excess of a return in single precision over a proved bound that is accepted."""
DIFFERENCE = 0.02
"""Differences of a score between a file and the replay that are reported."""


@dataclass(frozen=True)
class Result:
    """One policy of a method on the test episodes of a task.

    returns: of each episode, or their mean alone; empty before it is played. cost: mean of an
    episode, None without a limit. failures: share of the episodes. seed, steps, seconds (wall
    clock), processor_seconds (of all cores): of the training, None if unknown. policy: file, name
    in the package or baseline; None where only the returns are known. replayed: played here."""

    task: str
    returns: tuple[float, ...] = ()
    cost: float | None = None
    failures: float | None = None
    seed: int | None = None
    steps: int | None = None
    seconds: float | None = None
    processor_seconds: float | None = None
    policy: str | None = None
    replayed: bool = False

    @cached_property
    def score(self) -> Interval:
        """Score with its interval over the episodes; NaN over the cost limit."""
        known = measured(self.task)
        if not known.keeps(self.cost):
            return Interval(UNKNOWN)
        if len(self.returns) < known.episodes:
            return Interval(known.scale.score(self.returns[0]))
        return known.score(self.returns, range(known.episodes))


@dataclass(frozen=True)
class Method:
    """What is compared. about: algorithm, settings and machine in a sentence."""

    name: str
    results: tuple[Result, ...]
    about: str = ""

    def by_task(self) -> dict[str, list[Result]]:
        """The results on each task."""
        tasks = dict.fromkeys(one.task for one in self.results)
        return {name: [one for one in self.results if one.task == name] for name in tasks}


def read_methods(given: Sequence[str]) -> list[Method]:
    """The methods of names on a command line, not yet played: a directory with runs or policies is
    one method, as is a policy, a baseline or a file of results.

    ValueError for one that holds nothing, and for two methods of one name.
    """
    methods = list(map(_read_method, given))
    names = [method.name for method in methods]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"two methods are called {', '.join(twice)}; accepted: one of each name")
    return methods


def _read_method(given: str) -> Method:
    path = Path(given)
    if path.suffix == SUFFIX:
        return read_results(path)
    names = [given]
    if path.is_dir():  # of runs, or else of policy files
        of_runs = [one for one in sorted(path.rglob(runs.POLICY)) if _is_of_run(one)]
        names = list(map(str, of_runs or sorted(path.glob("*.npz"))))
    if not names:
        raise ValueError(f"{path} holds no policy; accepted: a run, or a directory of runs")
    name = path.resolve().name if path.exists() else given
    found = (one for who in names for one in _results_of(read_named([who])[who]))
    return _named(Method(name, tuple(found)))


def _is_of_run(policy: Path) -> bool:
    return policy.name == runs.POLICY and (policy.parent / runs.CONFIG).exists()


def _results_of(named: Named) -> Iterator[Result]:
    """What a policy is to be played on: its own task; a baseline, the tasks that it suits."""
    if named.policy is None:
        for task in TASKS:
            if named.name in (one.policy for one in measured(task).baselines):
                yield Result(task, policy=named.name)
        return
    if (task := named_task_of(named.metadata)) is None:
        given = f"{named.name} was trained on no named task"
        raise ValueError(f"{given}; accepted: policies of `stickslip train MACHINE --task NAME`")
    yield replace(Result(task.name, policy=named.name), **_training(policy_path(named.name)))


def _training(path: Path) -> dict[str, Any]:
    """Seed, steps and seconds of the run that a policy lies in."""
    if not _is_of_run(path):
        return {}
    found: dict[str, Any] = {"seed": runs.read_config(path.parent).seed}
    if checkpoints := runs.list_checkpoints(path.parent / "checkpoints"):
        state = runs.read_state(checkpoints[-1])
        found |= {"steps": state.timesteps, "seconds": state.seconds}
    return found


def read_results(path: Path) -> Method:
    """The method in a file of results; its policies lie beside it. ValueError naming the file."""
    with untrusted.reading(path, ACCEPTED):
        content = untrusted.parse_json(untrusted.read_text(path), "it")
        content = untrusted.require_head(content, FORMAT, VERSION, "a file of results")
        head = untrusted.require_entries({"about": ""} | content, HEAD, also="results")
        rows = content.get("results")
        if not isinstance(rows, list) or not 0 < len(rows) <= MOST_RESULTS:
            raise untrusted.RefusedError(f"results is no list of 1 to {MOST_RESULTS}")
        found = tuple(_result(row, path.parent) for row in rows)
        for (task, what, of), count in Counter(map(_run_of, found)).items():
            if count > 1:
                raise untrusted.RefusedError(f"{count} results on {task} have {what} {shown(of)}")
        return _named(Method(head["method"], found, " ".join(head["about"].split())))


def _run_of(one: Result) -> tuple[str, str, object]:
    """Task, and what tells a run there from others: its policy, else its seed, else its returns."""
    name = next(of for of in ("policy", "seed", "returns") if getattr(one, of) is not None)
    return one.task, name, getattr(one, name)


def _named(method: Method) -> Method:
    fit = METHOD_NAME.fullmatch(method.name) and not method.name.startswith(".")
    require_that(fit, "method", method.name, "up to 64 letters, digits, spaces, _, +, - and .")
    return method


def _result(row: untrusted.Json, folder: Path) -> Result:
    if not isinstance(row, dict):
        raise untrusted.RefusedError(f"the result {shown(row)} is no object")
    found, returns = untrusted.require_entries(row, RULES, also="returns"), row.get("returns", [])
    task = found["task"] = task_by_name(found["task"]).name
    if (digest := found.pop("episodes")) != (here := episodes_digest(TASKS[task])):
        raise untrusted.RefusedError(
            f"its episodes of {task} are {shown(digest)}, here {here}: of another version"
        )
    count, policy = measured(task).episodes, found.pop("policy")
    if not isinstance(returns, list) or len(returns) not in (1, count, 0 if policy else 1):
        raise untrusted.RefusedError(
            f"its returns on {task} are {shown(returns)}, not of {count} episodes or their mean"
        )
    rule = untrusted.Rule(float, "of an episode")
    numbers = tuple(rule.require("returns", one) for one in returns)
    if policy is not None and not _is_name(policy):
        path = folder / policy
        policy = None if numbers and not path.exists() else str(path)  # nothing to play
    if policy is not None:
        with reraise(f"its policy on {task}: ", kind=untrusted.RefusedError):
            read_named([policy], machine_by_name(TASKS[task].machine))
    elif (bound := measured(task).bound) is not None:
        mean = float(np.mean(numbers))
        if mean > bound.value + ROUNDING * abs(bound.value):
            raise untrusted.RefusedError(
                f"its mean return on {task} is {mean:.6g}, by more than rounding above the proved "
                f"bound of {bound.value:.6g}"
            )
    return Result(returns=numbers, policy=policy, **found)


def _is_name(policy: str) -> bool:
    """True for a policy of the package and for a baseline."""
    return shipped_path(policy) is not None or machine_of_baseline(policy) is not None


def replay(methods: Sequence[Method], say: Callable[[str], None]) -> list[Method]:
    """Play every policy at hand on its task's test episodes; say: called with a line before."""
    replayed: dict[Result, Result] = {}
    for task in TASKS:
        found = [one for each in methods for one in each.results if one.task == task and one.policy]
        if found:
            replayed |= _replayed(task, list(dict.fromkeys(found)), say)
    return [
        replace(method, results=tuple(replayed.get(one, one) for one in method.results))
        for method in methods
    ]


def _replayed(
    task: str, results: Sequence[Result], say: Callable[[str], None]
) -> dict[Result, Result]:
    """Results on a task by what they were before."""
    policies = list(dict.fromkeys(str(one.policy) for one in results))
    named = read_named(policies, machine_by_name(TASKS[task].machine))
    table = evaluate_task(task, players_on(task, named), progress=say)
    limited = measured(task).cost_limit is not None
    found = {}
    for before in results:
        row = table.row(task, str(before.policy))
        returns = tuple(map(float, row.episodes.reward))
        cost = row.metrics["cost"].value if limited else None
        failed = float(np.mean(row.episodes.fell))
        found[before] = replace(before, returns=returns, cost=cost, failures=failed, replayed=True)
    return found


def differences(before: Sequence[Method], after: Sequence[Method]) -> Iterator[str]:
    """A line for each score that a replay changed by more than DIFFERENCE."""
    for old, new in zip(before, after, strict=True):
        for one, other in zip(old.results, new.results, strict=True):
            claimed, earned = (each.score.value if one.returns else 0.0 for each in (one, other))
            if not np.isclose(claimed, earned, 0.0, DIFFERENCE, equal_nan=True):
                yield (
                    f"{old.name}: {one.policy} on {one.task} scores {claimed:z.3f} by its file and "
                    f"{earned:z.3f} in the replay, which counts"
                )


def write_results(method: Method, path: Path) -> Path:
    """Write a method's results as JSON, the paths of policies relative to the file."""
    rows = []
    for one in method.results:
        row = {**asdict(one), "episodes": episodes_digest(TASKS[one.task])}
        if one.policy is not None and not _is_name(one.policy):
            row["policy"] = os.path.relpath(policy_path(one.policy), path.parent)
        del row["replayed"]
        rows.append(row)
    head = {"format": FORMAT, "version": VERSION, "method": method.name, "about": method.about}
    return write_whole(path, json_text(head | {"results": rows}))
