"""`stickslip tasks`, `policies` and `export`: named tasks, policies of the package, their files."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.policy.file import existing_path, read_policy
from stickslip.agents.policy.record import every_record, record_of
from stickslip.envs.tasks.definition import TASKS, WITHDRAWN, task_by_name
from stickslip.envs.tasks.known import known_of
from stickslip.records.files import require_new, require_suffix, require_writable, write_whole
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from stickslip.agents.policy.record import Record
    from stickslip.envs.tasks.definition import TaskDefinition
    from stickslip.envs.tasks.known import Bound, Earned, Known

SCORES = """
Scores: 0 is a trivial policy (every action 0), 1 the most that a policy is known to have earned in
replay: no proof that no more can be. ±: half of a 95 % bootstrap interval of the difference on the
same episodes. "at most": proved. `stickslip tasks NAME` tells more."""
SHOWN = """
Scores: 0 is doing nothing, 1 the best known on the task's own episodes (`stickslip tasks`).
stickslip view NAME shows one, stickslip evaluate NAME plays it, `policies NAME` tells more."""


def tasks_command(flags: Mapping[str, Any]) -> Content:
    """Print all tasks in a table, or those named in words; return all about them."""
    tasks = [task_by_name(name) for name in flags["names"]] or list(TASKS.values())
    if flags["names"]:
        print("\n\n".join(map(_task_in_words, tasks)))
    else:
        words = [Column(name, words=True) for name in ("task", "asked")]
        heads = ("idle (0)", "by hand", "its score", "best known (1)", "at most")
        print(Table([*words, *map(Column, heads)], list(map(_task_row, tasks))).terminal() + SCORES)
        for name, reason in WITHDRAWN.items():
            print(f"{name}: withdrawn, refused: {reason}")
    facts = {"tasks": list(map(_task_facts, tasks)), "withdrawn": dict(WITHDRAWN)}
    units = {"tasks": {"value": "each task's unit", "scores": "-", "failures": "-"}}
    return Content(facts=facts, units=units)


def policies_command(flags: Mapping[str, Any]) -> Content:
    """Print all policies in a table, or those named in words; return all about them."""
    records = [record_of(name) for name in flags["names"]] or every_record()
    if flags["names"]:
        print("\n\n".join(map(_policy_in_words, records)))
    else:
        words = [Column(name, words=True) for name in ("policy", "asked")]
        heads = [Column("return"), Column("score"), Column("layers", words=True)]
        columns = [*words, *heads, Column("size", "kB")]
        print(Table(columns, list(map(_policy_row, records))).terminal() + SHOWN)
    facts = {"policies": list(map(_policy_facts, records))}
    units = {"policies": {"bytes": "B", "score": "-", "earned": "each one's unit"}}
    return Content(facts=facts, units=units)


def export_command(flags: Mapping[str, Any]) -> None:
    """Write a policy as ONNX or as a NumPy archive, by the ending of --out."""
    path, overwrite = Path(flags["out"]), flags["overwrite"]
    require_suffix(path, (".onnx", ".npz"))
    source = existing_path(flags["who"])
    policy, metadata = read_policy(source)
    require_new([path], overwrite)
    require_writable([path])
    if path.suffix.lower() == ".npz":
        write_whole(path, source.read_bytes(), overwrite=overwrite)
    else:
        from stickslip.agents.policy.exchange import export_onnx

        export_onnx(policy, path, metadata, overwrite=overwrite)
    sizes = policy.layer_sizes
    print(f"Written: {path}, {sizes[0]} numbers in, {sizes[-1]} out, normalisation included")


def _task_row(task: TaskDefinition) -> list[str]:
    known, cells = known_of(task), [""] * 5
    if known is not None:
        bound = "" if known.bound is None else f"{known.bound.value:.4g}"
        values = (f"{one.value:.4g}" for one in (known.trivial, known.by_hand))
        score = known.score_of(known.by_hand).shown(2)
        cells = [*values, score, f"{known.best.value:.4g}", bound]
    return [task.name, task.title, *cells]


def _task_in_words(task: TaskDefinition) -> str:
    """All about a task."""
    lines = [f"{task.name}: {task.title}", task.about, f"Gymnasium: {task.id}"]
    lines += [f"  {name} = {value}" for name, value in (task.choices | task.parameters).items()]
    known = known_of(task)
    if known is None:
        return "\n".join([*lines, "Nothing is known of it yet."])
    count = "1 episode" if known.episodes == 1 else f"{known.episodes} episodes, seeds 0, 1, ..."
    lines.append(f"Mean returns [{task.unit}] of {count}, and scores:")
    everybody = (known.trivial, *known.baselines, *known.planners, known.best)
    lines += [f"  {_earned_line(known, one)}" for one in dict.fromkeys(everybody)]
    if known.learned is not None:
        returns = ", ".join(f"{one:.4g}" for one in known.learned.returns)
        lines.append(f"  {known.learned.how}: {returns}")
    lines.append(f"Best known, a score of 1: {known.how}.")
    if known.bound is not None:
        lines.append(f"Proved: {_bounded(known, known.bound)}, as {known.bound.reason}.")
    if known.assumed is not None:
        line = f"Proved under assumptions: {_bounded(known, known.assumed)}, by "
        beaten = known.best.value > known.assumed.value
        more = " The best known does not, and earns more." if beaten else ""
        lines.append(f"{line}{known.assumed.reason}.{more}")
    return "\n".join(lines)


def _bounded(known: Known, bound: Bound) -> str:
    return f"at most {bound.value:.4g}, a score of {known.scale.score(bound.value):.2f}"


def _earned_line(known: Known, one: Earned) -> str:
    failures = f", {one.failures:.0%} fail" if one.failures else ""
    return f"{one.policy:<24}{one.value:10.4g}, score {known.score_of(one).shown(2)}{failures}"


def _task_facts(task: TaskDefinition) -> Mapping[str, object]:
    """Everything, with scores beside the returns."""
    known = known_of(task)
    about = {"name": task.name, "id": task.id, "digest": task.digest, "machine": task.machine}
    about |= asdict(task)
    if known is None:
        return about | {"known": None}
    scored = (*known.baselines, *known.planners)
    scores = {one.policy: known.score_of(one)._asdict() for one in scored}
    return about | {"known": asdict(known) | {"scores": scores}}


def _policy_row(one: Record) -> list[str]:
    score = "" if one.score is None else one.score.shown(2)
    value = f"{one.earned_return:.4g} {one.task.unit.removeprefix('-')}".rstrip()
    layers = " x ".join(map(str, one.layer_sizes))
    return [one.name, one.task.title, value, score, layers, f"{_bytes(one) / 1000:.1f}"]


def _policy_in_words(one: Record) -> str:
    earned, trained = one.earned, one.trained
    score = "" if one.score is None else f", score {one.score.shown(3)}"
    episodes = f"{earned['episodes']} episodes, {earned['failures']:.0%} failures"
    facts = {
        "file": f"{one.path}, {_bytes(one):,} bytes",
        "layers": " x ".join(map(str, one.layer_sizes)),
        "definition": one.task.digest,
        "earned": f"{one.earned_return:.4g}{score}, over {episodes}",
        "trained": f"{trained['timesteps']:,} steps, kept after {trained['best_after']:,}",
        "with": _pairs(trained["versions"]),
        "on": _pairs(trained["machine"]),
        "carried over, as by" if one.carried_over else "by": one.command,
    }
    lines = [f"  {name:<13}  {text}" for name, text in facts.items()]
    return "\n".join([f"{one.name}: {one.task.name}, {one.task.title}", *lines])


def _policy_facts(one: Record) -> Mapping[str, object]:
    return {
        "name": one.name,
        "task": one.task.name,
        "digest": one.task.digest,
        "path": str(one.path),
        "bytes": _bytes(one),
        "layer_sizes": list(one.layer_sizes),
        "score": None if one.score is None else one.score._asdict(),
        "unit": one.task.unit,
        "earned": one.earned,
        "trained": {**one.trained, "command": one.command},
    }


def _bytes(one: Record) -> int:
    return one.path.stat().st_size


def _pairs(found: object) -> str:
    pairs = found.items() if isinstance(found, dict) else ()
    return ", ".join(f"{name} {value}" for name, value in pairs)
