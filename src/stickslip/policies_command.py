"""`stickslip policies` and `stickslip export`: the package's policies, and a policy's file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.agents.policy.file import existing_path, read_policy
from stickslip.agents.policy.record import every_record, record_of
from stickslip.records.files import require_new, require_suffix, require_writable, write_whole
from stickslip.records.table import Column, Content, Table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.policy.record import Record

NOTE = """
Scores: 0 is doing nothing, 1 the best known on the task's own episodes (`stickslip tasks`).
stickslip view NAME shows one, stickslip evaluate NAME plays it, stickslip policies NAME tells more.
"""


def policies_command(flags: Mapping[str, Any]) -> Content:
    """Print all policies in a table, or those named in words; return all about them."""
    names = flags["names"]
    records = [record_of(name) for name in names] if names else every_record()
    if names:
        print("\n\n".join(map(_in_words, records)))
    else:
        print(_table(records).terminal() + NOTE.rstrip())
    facts = {"policies": [_content(one) for one in records]}
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


def _table(records: Sequence[Record]) -> Table:
    columns = [
        Column("policy", words=True),
        Column("asked", words=True),
        *map(Column, ("return", "score")),
        Column("layers", words=True),
        Column("size", "kB"),
    ]
    return Table(columns, [_row(one) for one in records])


def _row(one: Record) -> list[str]:
    score = "" if one.score is None else one.score.shown(2)
    unit = "" if one.task.unit == "-" else f" {one.task.unit}"
    sizes = " x ".join(map(str, one.layer_sizes))
    value = f"{one.earned['return']:.4g}{unit}"
    return [one.name, one.task.title, value, score, sizes, f"{_size(one) / 1000:.1f}"]


def _in_words(one: Record) -> str:
    earned, trained = one.earned, one.trained
    score = "" if one.score is None else f", score {one.score.shown(3)}"
    episodes = f"{earned['episodes']} episodes, {earned['failures']:.0%} failures"
    facts = {
        "file": f"{one.path}, {_size(one):,} bytes",
        "layers": " x ".join(map(str, one.layer_sizes)),
        "definition": one.task.digest,
        "earned": f"{earned['return']:.4g}{score}, over {episodes}",
        "trained": f"{trained['timesteps']:,} steps, kept after {trained['best_after']:,}",
        "with": _packages(trained["versions"]),
        "on": _packages(trained["machine"]),
        "carried over, as by" if one.carried_over else "by": one.command,
    }
    lines = [f"  {name:<13}  {text}" for name, text in facts.items()]
    return "\n".join([f"{one.name}: {one.task.name}, {one.task.title}", *lines])


def _size(one: Record) -> int:
    """Of the file [bytes]."""
    return one.path.stat().st_size


def _packages(found: object) -> str:
    pairs = found.items() if isinstance(found, dict) else ()
    return ", ".join(f"{name} {value}" for name, value in pairs)


def _content(one: Record) -> Mapping[str, object]:
    return {
        "name": one.name,
        "task": one.task.name,
        "digest": one.task.digest,
        "path": str(one.path),
        "bytes": _size(one),
        "layer_sizes": list(one.layer_sizes),
        "score": None if one.score is None else one.score._asdict(),
        "unit": one.task.unit,
        "earned": one.earned,
        "trained": {**one.trained, "command": one.command},
    }
