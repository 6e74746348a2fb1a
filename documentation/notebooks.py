"""Notebooks as pages: their text and code; outputs are what running one gives."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from documentation.names import ROOT

FOLDER = ROOT / "notebooks"


def files() -> list[Path]:
    """All notebooks, in the order of their names."""
    return sorted(FOLDER.glob("*.ipynb"))


@cache
def pages() -> dict[str, str]:
    """Markdown by path below docs."""
    return {f"notebooks/{path.stem}.md": _page(path) for path in files()}


def _page(path: Path) -> str:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    title, *rest = [_text(cell) for cell in cells]
    note = f"*As [a notebook]({path.name}); running it shows what each cell prints and draws.*"
    return "\n\n".join([title, note, *rest]) + "\n"


def _text(cell: dict[str, Any]) -> str:
    source = "".join(cell["source"]).strip()
    return source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```"
