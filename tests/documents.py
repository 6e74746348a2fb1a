"""What stands between fences in README and docs: programs with what they print, and commands."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from tests.typing.as_user import documents, missing

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SHOWN = re.compile(r"\n\n```text\n(.*?)```", re.DOTALL)
LANGUAGES = {"python", "py", "sh", "", "text", "bibtex", "yaml"}
"""python: run. py: compiled, and run by tests of their own. sh, or none: commands."""


@dataclass(frozen=True)
class Block:
    """A fenced block. line: of its fence. shown: the text block right behind it."""

    page: str
    line: int
    language: str
    code: str
    shown: str | None


def blocks(path: Path) -> Iterator[Block]:
    """All of a document's, in order."""
    text = path.read_text(encoding="utf-8")
    page = path.relative_to(ROOT).as_posix()
    for found in FENCE.finditer(text):
        line = text.count("\n", 0, found.start()) + 1
        shown = SHOWN.match(text, found.end())
        yield Block(page, line, found[1], found[2], shown[1] if shown else None)


def every_block() -> list[Block]:
    """Of all documents."""
    return [block for path in documents() for block in blocks(path)]


def programs() -> list[list[Block]]:
    """Blocks of Python that go on from each other: one that uses names which it does not make
    continues the one before it. The same program on two pages counts once."""
    found: list[list[Block]] = []
    for block in every_block():
        if block.language != "python":
            continue
        if found and found[-1][-1].page == block.page and missing(block.code):
            found[-1].append(block)
        else:
            found.append([block])
    return list({"".join(block.code for block in chain): chain for chain in found}.values())
