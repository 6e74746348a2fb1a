"""Command line, JSON, tables and provenance of every benchmark, and statistics of settings."""

from __future__ import annotations

import argparse
import ast
import json
import math
import os
import platform
import re
import subprocess
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar

import jax

from stickslip.agents.policy.file import installed
from stickslip.records.files import write_whole
from stickslip.records.table import Column, Table, json_text

PACKAGES = ("stickslip", "jax", "jaxlib", "numpy", "gymnasium", "stable-baselines3", "torch")
P = TypeVar("P", bound=Any)
"""A setting with its `cost` [s] and `error`, the worst of its errors in one unit."""

USEFUL = 0.1
"""Largest error of a point of a front, in its own unit: beyond it, the answer is but a guess."""
RESULTS = Path("benchmarks/results")
MARKS = ("<!-- measured: begin -->", "<!-- measured: end -->")
"""Marks around the measured tables of a page that has no other."""


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
        "versions": installed(PACKAGES),
        "commit": _commit(),
        "measured": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def markdown(rows: list[dict[str, Any]]) -> str:
    """A Markdown table with the first row's keys as its head: floats with four digits, nothing for
    None. A column whose every cell begins with a digit holds numbers, which stand to the right."""
    words = {name: not all(str(row[name])[:1].isdigit() for row in rows) for name in rows[0]}
    columns = [Column(name, words=word) for name, word in words.items()]
    table = Table(columns, [[row[name] for name in words] for row in rows])
    return table.rounded(4).markdown(aligned=True)[:-1]


def write_json(content: dict[str, Any], path: Path) -> None:
    """Write the file whole or not at all."""
    write_whole(path, json_text(content))


def read_json(path: Path) -> dict[str, Any]:
    """Content of the file; empty where there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def measured_parts(
    measure: dict[str, Callable[[bool], Iterator[dict[str, Any]]]],
    parts: Iterable[str],
    quick: bool,
    out: Path,
) -> dict[str, Any]:
    """Measure some parts row by row and write the JSON after each; its other parts stay.

    measure: part -> function of `quick` that yields rows. parts: all that the file may hold.
    "parts" of the JSON holds each one's commit and time.
    """
    earlier = read_json(out)
    content = {**provenance(), "parts": dict(earlier.get("parts", {}))}
    content |= {part: earlier[part] for part in parts if part in earlier}
    for part, rows_of in measure.items():
        begun, rows = time.perf_counter(), []
        for row in rows_of(quick):
            rows.append(row)
            values = list(row.values())[:9]
            shown = ", ".join(f"{v:.3g}" if isinstance(v, float) else str(v) for v in values)
            print(f"{part} {len(rows)} [{time.perf_counter() - begun:.0f} s]: {shown}", flush=True)
        content[part] = rows
        content["parts"][part] = {
            "commit": content["commit"],
            "measured": datetime.now(UTC).isoformat(timespec="seconds"),
            "quick": quick,
            "seconds": time.perf_counter() - begun,
        }
        write_json(content, out)
    print(f"Written: {out}")
    return content


def measured_by_command(
    name: str,
    about: str | None,
    parts: dict[str, Callable[[bool], Iterator[dict[str, Any]]]],
    update: Callable[[dict[str, Any]], None],
    arguments: list[str] | None = None,
) -> None:
    """Run `python -m benchmarks.NAME`: measure parts and write the JSON, whose other parts stay.

    parts: see `measured_parts`. update: writes pages and data from the JSON, for --update, and for
    --redraw, which measures nothing.
    """
    parser = options(name, about)
    add = parser.add_argument
    add("--only", nargs="+", choices=list(parts), default=list(parts), help="measure these alone")
    add("--quick", action="store_true", help="a few of each")
    add("--update", action="store_true", help="also write pages and data")
    add("--redraw", action="store_true", help="write pages and data from the JSON there is")
    given = parser.parse_args(arguments)
    content = read_json(given.out)
    if not given.redraw:
        asked = {part: parts[part] for part in given.only}
        content = measured_parts(asked, parts, given.quick, given.out)
    if given.update or given.redraw:
        update(content)


def where(content: dict[str, Any], part: str | None = None) -> str:
    """Machine, versions and commit of a measurement or a part, in a line."""
    machine, versions = content["machine"], content["versions"]
    own = content if part is None else content["parts"][part]
    return (
        f"{machine['processor']}, {machine['cores']} cores, "
        f"jax {versions['jax']}, commit {own['commit']}, {own['measured'][:10]}"
    )


def rows_json(content: dict[str, Any]) -> str:
    """JSON with each row of a list in a line of its own."""

    def text(value: Any) -> str:
        if not isinstance(value, list):
            return json.dumps(value, ensure_ascii=False)
        return "[\n  " + ",\n  ".join(map(json.dumps, value)) + "\n ]"

    lines = [f' "{name}": {text(value)}' for name, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def three(number: float) -> float | None:
    """The number with three digits; None, JSON's null, for infinity."""
    return None if math.isinf(number) else float(f"{number:.3g}")


def code_of(spec: Any, *always: str) -> str:
    """The expression that makes a dataclass; defaults left out, but for the fields of `always`."""
    given = [
        f"{one.name}={getattr(spec, one.name)!r}"
        for one in fields(spec)
        if one.name in always or getattr(spec, one.name) != one.default
    ]
    return f"{type(spec).__name__}({', '.join(given)})"


def called(code: str) -> list[Any]:
    """Class name and keyword arguments of a call like Table(pieces=32, degree=7)."""
    call: Any = ast.parse(code, mode="eval").body
    return [call.func.id, {str(k.arg): ast.literal_eval(k.value) for k in call.keywords}]


def put_between(path: Path, text: str, name: str = "") -> None:
    """Replace what stands between the marks of a page; ValueError if they are not there once.

    name: of the place, in marks like <!-- suite --> and <!-- end of suite -->; else MARKS.
    """
    marks = (f"<!-- {name} -->", f"<!-- end of {name} -->") if name else MARKS
    page = path.read_text(encoding="utf-8")
    if any(page.count(mark) != 1 for mark in marks) or page.find(marks[0]) > page.find(marks[1]):
        raise ValueError(
            f"{path} has no place for the tables; accepted: one {marks[0]} and, after it, one "
            f"{marks[1]}"
        )
    before, rest = page.split(marks[0])
    after = rest.split(marks[1])[1]
    write_whole(path, f"{before}{marks[0]}\n{text}\n{marks[1]}{after}")


def front_of(points: Sequence[P]) -> list[P]:
    """Points that no other beats in cost and error, the cheapest first; error <= USEFUL."""
    found: list[P] = []
    for point in sorted(points, key=lambda p: (p.cost, p.error)):
        if point.error < (found[-1].error if found else USEFUL * (1 + 1e-12)):
            found.append(point)
    return found


def knee_of(points: Sequence[P]) -> P:
    """The knee of the front: farthest below the chord of its ends, in log-log.

    Both axes are scaled to the front's extent first. Of a front of one or two points, its last.
    ValueError if no error is within USEFUL.
    """
    along = front_of(points)
    if not along:
        raise ValueError(f"no front: every error exceeds {USEFUL:g}; accepted: one within")
    if len(along) < 3:
        return along[-1]
    costs, errors = ([p.cost for p in along], [p.error for p in along])
    x, y = ([math.log(max(value, 1e-300)) for value in each] for each in (costs, errors))
    across, down = x[-1] - x[0], y[0] - y[-1]
    below = [1 - (a - x[0]) / across - (b - y[-1]) / down for a, b in zip(x, y, strict=True)]
    return along[max(range(len(along)), key=lambda i: below[i])]


def upper_bound(values: Iterable[float], quantile: float, confidence: float) -> float:
    """The value that bounds the quantile from above with this confidence; infinite for too few.

    The k-th of the sorted values, whatever their distribution: the least k for which
    P(Binomial(count, quantile) <= k - 1) >= confidence.
    """
    from scipy.stats import binom

    ordered = [*sorted(values), math.inf]
    return float(ordered[int(binom.ppf(confidence, len(ordered) - 1, quantile))])


def _commit() -> str | None:
    command, here = ["git", "rev-parse", "--short", "HEAD"], Path(__file__).parent
    found = subprocess.run(command, capture_output=True, text=True, check=False, cwd=here)
    return found.stdout.strip() or None


def _processor() -> str:
    about = Path("/proc/cpuinfo")
    named = about.exists() and re.search(r"model name\s*:(.*)", about.read_text(encoding="utf-8"))
    return named[1].strip() if named else platform.processor() or platform.machine()
