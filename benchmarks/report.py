"""What every benchmark writes: where it was measured, a table, a JSON file."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import tempfile
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jax

PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "gymnasium", "stable-baselines3", "torch")


def provenance() -> dict[str, Any]:
    """Machine, versions, commit and time of a measurement."""
    return {
        "machine": {
            "processor": _processor(),
            "cores": os.cpu_count(),
            "system": platform.system(),
            "python": platform.python_version(),
            "device": jax.devices()[0].device_kind,
        },
        "versions": {name: found for name in PACKAGES if (found := _version(name))},
        "commit": _commit(),
        "measured": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def markdown(rows: list[dict[str, Any]]) -> str:
    """A Markdown table with the first row's keys as its head; numbers to the right."""
    head = list(rows[0])
    cells = [[str(row[name]) for name in head] for row in rows]
    width = [max(len(line[i]) for line in [head, *cells]) for i in range(len(head))]
    numeric = [all(line[i][:1].isdigit() for line in cells) for i in range(len(head))]

    def line(words: list[str]) -> str:
        shown = (
            word.rjust(size) if right else word.ljust(size)
            for word, size, right in zip(words, width, numeric, strict=True)
        )
        return "| " + " | ".join(shown) + " |"

    rule = [
        "-" * (size - 1) + ":" if right else "-" * size
        for size, right in zip(width, numeric, strict=True)
    ]
    return "\n".join([line(head), line(rule), *map(line, cells)])


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write to a temporary name beside `path`, then rename."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(
        "w", dir=path.parent, suffix=".tmp", delete=False, encoding="utf-8"
    ) as file:
        json.dump(content, file, indent=1)
        file.write("\n")
    Path(file.name).replace(path)


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    found = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parent,
    )
    return found.stdout.strip() or None


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
