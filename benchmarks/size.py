"""Size of the project.

    python -m benchmarks.size [--only PART ...] [--docs docs/design.md]

Lines are those of the files, blank ones and docstrings included. Flags are the long options of
each command, for either machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.report import markdown, put_between

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ("dynamics", "optim", "envs", "agents", "src")
PARTS = ("source", "words", "flags")
MACHINES = ("biped", "ugv")


def source() -> list[dict[str, Any]]:
    """Lines, files and folders of Python."""
    found = [_python("package", PACKAGE)]
    found += [_python(name, (name,)) for name in ("benchmarks", "tests")]
    return [*found, _python("documentation, release", ("documentation", "release"))]


def words() -> list[dict[str, Any]]:
    """Words of the documents."""
    readme, pages = ROOT / "README.md", sorted((ROOT / "docs").glob("*.md"))
    each = {page: len(page.read_text(encoding="utf-8").split()) for page in (readme, *pages)}
    return [
        {"of": "README", "words": each[readme]},
        {"of": "README and docs", "words": sum(each.values())},
    ]


def _python(name: str, folders: Iterable[str]) -> dict[str, Any]:
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    lines = sum(len(file.read_text(encoding="utf-8").splitlines()) for file in files)
    return {
        "of": name,
        "lines": lines,
        "files": len(files),
        "folders": len({file.parent for file in files}),
        "longest file": max(len(f.read_text(encoding="utf-8").splitlines()) for f in files),
    }


def flags() -> list[dict[str, Any]]:
    """Flags of all commands together, and of `train biped`."""
    from stickslip.commands import COMMANDS

    each = {name: set().union(*(_flags([name, one]) for one in MACHINES)) for name in COMMANDS}
    total = sum(map(len, each.values()))
    return [
        {"of": "all commands", "flags": total},
        {"of": "train biped", "flags": len(_flags(["train", "biped"]))},
    ]


def _flags(words: list[str]) -> set[str]:
    """Long options of a command."""
    from stickslip.cli import make_parser

    parser: Any = make_parser(words)
    for word in words:
        inner = (one.choices for one in parser._actions if isinstance(one.choices, dict))
        parser = next(inner, {}).get(word, parser)
    return {text for one in parser._actions for text in one.option_strings if text[:2] == "--"}


def main(arguments: list[str] | None = None) -> None:
    """Count, print the tables, put them into a page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--docs", type=Path, help="page that holds the tables")
    given = parser.parse_args(arguments)
    measure = {"source": source, "words": words, "flags": flags}
    text = "\n\n".join(markdown(measure[part]()) for part in given.only)
    print(text)
    if given.docs:
        put_between(given.docs, text, "size")


if __name__ == "__main__":
    main()
