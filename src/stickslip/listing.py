"""`stickslip tasks` and `policies`: named tasks, policies of the package."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from stickslip.agents.policy.file import Record, every_record, policy_path, read_metadata, record_of
from stickslip.agents.policy.shipped import shipped_path
from stickslip.dynamics.checks import shown
from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, TaskDefinition, task_by_name
from stickslip.envs.tasks.known import OVER, Interval, episodes_digest, measured
from stickslip.records.table import Column, Content, Table, with_unit

SCORES = """
Scores: 0 is a trivial policy (every action 0), 1 the most that a policy is known to have earned in
replay: no proof that no more can be. Tiers: PPO's defaults solve a check, no trained policy has
reached 0.8 in a hard one. ±: half of a 95 % bootstrap interval of the difference on the
same episodes. "at most": proved. `stickslip tasks NAME` tells more."""
SHOWN = """
Scores: 0 is doing nothing, 1 the best known on the task's own episodes (`stickslip tasks`).
stickslip view NAME shows one, stickslip evaluate NAME plays it, `policies NAME` tells more."""


def tasks_command(flags: Mapping[str, Any]) -> Content:
    """Print all tasks in a table, or all about those named; return all about them."""
    tasks = [task_by_name(name) for name in flags["names"]] or list(TASKS.values())
    facts = list(map(_task_facts, tasks))
    if flags["names"]:
        print("\n".join(map(in_words, facts)), end="")
    else:
        words = [Column(name, words=True) for name in ("task", "tier", "asked")]
        heads = ("idle (0)", "by hand", "its score", "best known (1)", "at most")
        print(Table([*words, *map(Column, heads)], list(map(_task_row, tasks))).terminal() + SCORES)
        for name, reason in WITHDRAWN.items():
            print(f"{name}: withdrawn, refused: {reason}")
    units = {"tasks": {"value": "each task's unit", "scores": "-", "failures": "-"}}
    return Content(facts={"tasks": facts, "withdrawn": dict(WITHDRAWN)}, units=units)


def policies_command(flags: Mapping[str, Any]) -> Content:
    """Print all policies in a table, or all about those named; return all about them."""
    if flags["names"]:
        facts = list(map(_facts_of, flags["names"]))
        print("\n".join(map(in_words, facts)), end="")
    else:
        records = every_record()
        facts = list(map(_policy_facts, records))
        words = [Column(name, words=True) for name in ("policy", "asked")]
        heads = [Column("return"), Column("score"), Column("layers", words=True)]
        columns = [*words, *heads, Column("size", "kB")]
        print(Table(columns, list(map(_policy_row, records))).terminal() + SHOWN)
    units = {"policies": {"bytes": "B", "score": "-", "earned": "each one's unit"}}
    return Content(facts={"policies": facts}, units=units)


def in_words(facts: Mapping[str, Any], depth: int = 0) -> str:
    """Names and values, a line each, nested ones further in; no returns of episodes, nothing that
    cannot be printed."""
    lines, margin = [], "  " * depth
    for name, value in facts.items():
        if isinstance(value, Mapping):
            lines.append(f"{margin}{name}:\n{in_words(value, depth + 1)}")
        elif isinstance(value, tuple) and value and isinstance(value[0], Mapping):
            rows = (", ".join(in_words(one).splitlines()) for one in value)
            lines.append("".join([f"{margin}{name}:\n", *(f"{margin}  {row}\n" for row in rows)]))
        elif value is not None and name != "returns":
            text = f"{value:.6g}" if isinstance(value, float) else str(value)
            text = shown(value) if isinstance(value, list) and len(value) > 16 else text
            if isinstance(value, Interval):
                text = value.shown(3) if value.value == value.value else OVER
            lines.append(f"{margin}{name} = {text}\n")
    return "".join(one for one in "".join(lines) if one.isprintable() or one == "\n")


def _task_row(task: TaskDefinition) -> list[str]:
    known = measured(task.name)
    bound = "" if known.bound is None else f"{known.bound.value:.4g}"
    idle, by_hand, best = (f"{o.value:.4g}" for o in (known.trivial, known.by_hand, known.best))
    score = known.score_of(known.by_hand).shown(2)
    return [task.name, task.tier, task.title, idle, by_hand, score, best, bound]


def _task_facts(task: TaskDefinition) -> Mapping[str, object]:
    """Everything, with scores beside the returns."""
    known = measured(task.name)
    about = {"name": task.name, "id": task.id, "digest": task.digest, "machine": task.machine}
    about |= {"test_episodes": episodes_digest(task), **asdict(task)}
    scores = {one.policy: known.score_of(one) for one in (*known.baselines, *known.planners)}
    return about | {"known": asdict(known) | {"scores": scores}}


def _policy_row(one: Record) -> list[str]:
    value = with_unit(one.earned_return, one.task.unit, 4)
    layers, size = " x ".join(map(str, one.layer_sizes)), one.path.stat().st_size
    return [one.name, one.task.title, value, one.score.shown(2), layers, f"{size / 1000:.1f}"]


def _facts_of(name: str) -> Mapping[str, object]:
    """All about a policy of the package; what another's file says, but its task's numbers."""
    if shipped_path(name) is None:
        metadata, path = read_metadata(name), policy_path(name)
        own = {"name": name, "path": str(path), "bytes": path.stat().st_size}
        return own | {key: metadata[key] for key in metadata if key not in (*own, "task")}
    return _policy_facts(record_of(name))


def _policy_facts(one: Record) -> Mapping[str, object]:
    return {
        "name": one.name,
        "task": one.task.name,
        "digest": one.task.digest,
        "path": str(one.path),
        "bytes": one.path.stat().st_size,
        "layer_sizes": list(one.layer_sizes),
        "score": one.score,
        "unit": one.task.unit,
        "earned": one.earned,
        "trained": {**one.trained, "command": one.command},
    }
