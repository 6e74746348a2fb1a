"""Notebooks as pages: their text, code, and what came of it when they were last run."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from documentation.executed import cells_of, files


@cache
def pages() -> dict[str, str]:
    """Markdown by path below docs."""
    return {f"notebooks/{path.stem}.md": _page(path) for path in files()}


def _page(path: Path) -> str:
    title, *rest = [_text(cell) for cell in cells_of(path)]
    note = f"*As [a notebook]({path.name}), which is stored without what it prints and draws.*"
    return "\n\n".join([title, note, *rest]) + "\n"


def _text(cell: dict[str, Any]) -> str:
    if cell["kind"] == "markdown":
        return cell["source"]
    return "\n\n".join([f"```python\n{cell['source']}\n```", *map(_output, cell["outputs"])])


def _output(output: dict[str, str]) -> str:
    if "picture" in output:
        return f"![what the cell above draws]({output['picture']})"
    return f"```text\n{output['text']}\n```"
