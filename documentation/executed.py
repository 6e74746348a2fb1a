"""What the notebooks print and draw, kept for the site: `make notebooks` runs them.

    python -m documentation.executed [NAME ...]

The notebooks themselves are stored without outputs. docs/notebooks holds, by a notebook's name, a
.json with the source of each code cell and what came of it, and the pictures. A test asks that the
sources are still those of the notebook.
"""

from __future__ import annotations

import base64
import json
import platform
import re
import sys
import tempfile
import textwrap
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from documentation.names import ROOT
from stickslip.records.files import write_whole

NOTEBOOKS = ROOT / "notebooks"
KEPT = ROOT / "docs" / "notebooks"
LONGEST = 900
"""Seconds of a cell."""
NAMED = re.compile(r"(?:\w+Path\()?'?([\w-]+\.\w+)'?\)?")
FILMS = (".gif", ".png")
"""A file that a cell names as its result, and endings of those that are shown."""


def files() -> list[Path]:
    """All notebooks, in the order of their names."""
    return sorted(NOTEBOOKS.glob("*.ipynb"))


@cache
def cells_of(path: Path) -> list[dict[str, Any]]:
    """A notebook's cells: kind, source and, of code, the outputs that are kept."""
    found = [
        {"kind": cell["cell_type"], "source": "".join(cell["source"]).strip(), "outputs": []}
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
    ]
    kept = KEPT / f"{path.stem}.json"
    code = [cell for cell in found if cell["kind"] == "code"]
    if kept.is_file():
        ran = json.loads(kept.read_text(encoding="utf-8"))["cells"]
        if [one["source"] for one in ran] == [one["source"] for one in code]:
            for cell, one in zip(code, ran, strict=True):
                cell["outputs"] = one["outputs"]
    return found


def run(path: Path) -> None:
    """Run a notebook in a kernel and a folder of its own, and keep what comes of it."""
    import nbformat
    from nbclient import NotebookClient

    with tempfile.TemporaryDirectory() as folder:
        found = nbformat.read(path, as_version=4)
        resources = {"metadata": {"path": folder}}
        NotebookClient(found, timeout=LONGEST, kernel_name="python3", resources=resources).execute()
        for old in KEPT.glob(f"{path.stem}-*"):
            old.unlink()
        code = [cell for cell in found.cells if cell.cell_type == "code"]
        ran = [
            {
                "source": cell.source.strip(),
                "outputs": _kept(cell.outputs, f"{path.stem}-{place}", Path(folder)),
            }
            for place, cell in enumerate(code, 1)
        ]
    about = {"python": platform.python_version(), "jax": version("jax")}
    content = json.dumps({"with": about, "cells": ran}, indent=1, ensure_ascii=False)
    write_whole(KEPT / f"{path.stem}.json", content + "\n")


def _kept(outputs: list[Any], name: str, folder: Path) -> list[dict[str, str]]:
    """Text and pictures of a cell; what went to standard error is progress, and goes."""
    kept: list[dict[str, str]] = []
    for output in outputs:
        data = output.get("data", {})
        if output.get("name") == "stderr":
            continue
        text = output.get("text") or data.get("text/plain", "")
        named = NAMED.fullmatch(text.strip())
        shown = folder / named[1] if named else folder
        if "image/png" in data:
            picture, content = f"{name}.png", base64.b64decode(data["image/png"])
        elif shown.suffix in FILMS and shown.is_file():
            picture, content = f"{name}{shown.suffix}", shown.read_bytes()
        else:
            kept.append({"text": textwrap.dedent(text).rstrip("\n")})
            continue
        KEPT.mkdir(parents=True, exist_ok=True)
        (KEPT / picture).write_bytes(content)
        kept.append({"picture": picture})
    return kept


def main(names: list[str]) -> None:
    """Run all notebooks, or those that are named."""
    there = {path.stem: path for path in files()}
    if unknown := sorted(set(names) - set(there)):
        sys.exit(f"{', '.join(unknown)}: no such notebook; there are {', '.join(there)}")
    for name in names or there:
        print(f"running {name} ...", file=sys.stderr, flush=True)
        run(there[name])


if __name__ == "__main__":
    main(sys.argv[1:])
