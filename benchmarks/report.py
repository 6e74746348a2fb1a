"""What every benchmark reads and writes: its command line, JSON, tables, where it was measured."""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
from collections.abc import Iterable
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jax

from stickslip.records.files import write_whole
from stickslip.records.table import Table, json_text

PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "gymnasium", "stable-baselines3", "torch")
RESULTS = Path("benchmarks/results")
MARKS = ("<!-- measured: begin -->", "<!-- measured: end -->")
"""What a page holds around the tables made from a measurement."""


def options(name: str, about: str | None, out: Path | None = None) -> argparse.ArgumentParser:
    """The command line of `python -m benchmarks.NAME`: --out and whatever its caller adds.

    about: the docstring of the module, shown as it is. out: the default, else results/NAME.json.
    """
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks.{name}",
        description=about,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--out", type=Path, default=out or RESULTS / f"{name}.json")
    return parser


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
    return Table.of_rows(rows).markdown(aligned=True).rstrip("\n")


def folded(title: str, text: str) -> str:
    """Markdown that is shown when its title is clicked, on the site and on GitHub alike."""
    return f'<details markdown="1">\n<summary>{title}</summary>\n\n{text}\n\n</details>'


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write the file whole or not at all."""
    write_whole(path, json_text(content))


def read_json(path: Path) -> dict[str, Any]:
    """What the file holds; nothing where there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def kept_parts(path: Path, parts: Iterable[str]) -> dict[str, Any]:
    """Where this run measures, with the parts that the file at `path` has from earlier runs.

    "parts" holds each one's commit and time, since a run may measure only some of them.
    """
    earlier = read_json(path)
    content = {**provenance(), "parts": dict(earlier.get("parts", {}))}
    return content | {part: earlier[part] for part in parts if part in earlier}


def where(content: dict[str, Any], part: str | None = None) -> str:
    """What all of it, or a part, was measured on, in a line."""
    machine, versions = content["machine"], content["versions"]
    own = content if part is None else content["parts"][part]
    return (
        f"{machine['processor']}, {machine['cores']} cores, "
        f"jax {versions['jax']}, commit {own['commit']}, {own['measured'][:10]}"
    )


def put_between(path: Path, text: str, marks: tuple[str, str] = MARKS) -> None:
    """Replace what stands between the marks of a page; ValueError if they are not there once."""
    page = path.read_text(encoding="utf-8")
    if any(page.count(mark) != 1 for mark in marks) or page.find(marks[0]) > page.find(marks[1]):
        raise ValueError(
            f"{path} has no place for the tables; accepted: one {marks[0]} and, after it, one "
            f"{marks[1]}"
        )
    before, rest = page.split(marks[0])
    after = rest.split(marks[1])[1]
    write_whole(path, f"{before}{marks[0]}\n{text}\n{marks[1]}{after}")


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
