"""`stickslip policies`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from stickslip.commands import OK, Outcome
from stickslip.commands.shared import shipped
from stickslip.parser import add_tables, completes

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence

    from stickslip.agents.policy.record import Record
    from stickslip.records.table import Table

JSON = True
EXAMPLES = {
    "stickslip policies": "all of them",
    "stickslip policies biped-ice": "one in words: how it was trained, what it earns",
    "stickslip policies --json": "every number, for a program to read",
}
NOTE = """
Scores: 0 is doing nothing, 1 the best known on the task's own episodes (`stickslip tasks`).
stickslip view NAME shows one, stickslip evaluate NAME plays it, stickslip policies NAME tells more.
"""


def add_flags(parser: argparse.ArgumentParser, arguments: Sequence[str]) -> None:
    """Add the policies' names."""
    del arguments
    tables = shipped()
    names = parser.add_argument(
        "names", nargs="*", metavar="NAME", help="one or more of those below"
    )
    completes(names, tables["policies"])
    add_tables(parser, tables)


def run(given: argparse.Namespace) -> Outcome:
    """Print all policies in a table, or those named in words; return all about them."""
    from stickslip.agents.policy.record import every_record, record_of
    from stickslip.records.content import Content

    records = [record_of(name) for name in given.names] if given.names else every_record()
    if given.names:
        print("\n\n".join(map(_in_words, records)))
    else:
        print(_table(records).terminal() + NOTE.rstrip())
    facts = {"policies": [_content(one) for one in records]}
    units = {"policies": {"bytes": "B", "score": "-", "earned": "each one's unit"}}
    return Outcome(OK, Content(facts=facts, units=units))


def _table(records: Sequence[Record]) -> Table:
    from stickslip.records.table import Column, Table

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
    lines = [
        f"{one.name}: {one.task.name}, {one.task.title}",
        f"  file           {one.path}, {_size(one):,} bytes",
        f"  layers         {' x '.join(map(str, one.layer_sizes))}",
        f"  definition     {one.task.digest}",
        f"  earned         {earned['return']:.4g}{score}, over {earned['episodes']} "
        f"episode{'' if earned['episodes'] == 1 else 's'}, {earned['failures']:.0%} failures",
        f"  trained        {trained['timesteps']:,} steps, kept after {trained['best_after']:,}",
        f"  with           {_packages(trained['versions'])}",
        f"  on             {_packages(trained['machine'])}",
        f"{'Carried over, trained as by' if one.carried_over else 'Again'}: {one.command}",
    ]
    return "\n".join(lines)


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
