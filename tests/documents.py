"""What stands between fences in README and docs: programs with what they print, and commands."""

from __future__ import annotations

import ast
import builtins
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SHOWN = re.compile(r"\n\n```text\n(.*?)```", re.DOTALL)
KNOWN = {*dir(builtins), "__name__", "__file__"}
LANGUAGES = {"python", "py", "sh", "", "text", "bibtex", "toml", "yaml", "json"}
"""python: run. py: compiled, and run by tests of their own. sh, or none: commands."""


def documents() -> list[Path]:
    """Where Python may be shown."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def missing(code: str) -> set[str]:
    """The names that a program uses and nowhere makes."""
    nodes = list(ast.walk(ast.parse(code)))
    names = [node for node in nodes if isinstance(node, ast.Name)]
    made = {name.id for name in names if isinstance(name.ctx, ast.Store)}
    made |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            made |= {(one.asname or one.name).split(".")[0] for one in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            made.add(node.name)
    return {name.id for name in names} - made - KNOWN


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
