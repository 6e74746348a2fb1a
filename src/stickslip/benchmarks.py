"""List and run benchmarks (`stickslip bench`).

That of the package runs in this process. Those of the repository's folder benchmarks/ need a
checkout, and each runs in a process of its own, which loads nothing but what it measures.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.checks import require_choice

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.records.table import Content

PACKAGED = "optimisers"
"""Name of the benchmark that comes with the package; the others are modules of benchmarks/."""
BENCHMARKS = {
    PACKAGED: "optimisers on the suite's instances",
    "bounds": "lower bounds of the UGV's cost",
    "gaits": "the biped's best gaits",
    "peers": "the same walks in MuJoCo",
    "policies": "the trained policies of the package",
    "size": "lines, flags, and files that a call enters",
    "suite": "best known values of the suite",
    "tasks": "returns on each task",
    "throughput": "environment steps a second",
    "tradeoff": "the biped's speed against accuracy",
    "training": "PPO on every task",
    "ugv": "the UGV's speed against accuracy",
}
NEEDED = (
    "a checkout of the project: clone its repository, install it there with `pip install -e "
    ".[bench]`, and run `stickslip bench NAME` in that folder"
)


def bench_command(flags: Mapping[str, Any]) -> Content:
    """List the benchmarks, or run one. --json may stand behind its name, too."""
    name, rest = flags["name"], [one for one in flags["rest"] if one != "--json"]
    if name is None:
        return list_benchmarks()
    require_choice("benchmark", name, BENCHMARKS)
    if name == PACKAGED:
        from stickslip.races import run

        return run(rest)
    if flags["json"] or len(rest) < len(flags["rest"]):
        raise ValueError(f"benchmark {name!r} writes its own JSON; accepted: --out FILE")
    return run_benchmark(name, rest)


def list_benchmarks() -> Content:
    """Print a table of all, and what is needed for those that do not run here; return it."""
    from stickslip.records.table import Column, Content, Table

    root = checkout()
    rows = [
        [name, name == PACKAGED or root is not None, about] for name, about in BENCHMARKS.items()
    ]
    heads = [Column(name, words=True) for name in ("benchmark", "runs_here", "about")]
    table = Table(heads, rows)
    print(table.terminal())
    if root is None:
        print(f"The others need {NEEDED}")
    return Content({"benchmarks": table}, {"checkout": None if root is None else str(root)})


def run_benchmark(name: str, arguments: Sequence[str]) -> Content:
    """Run a benchmark of the checkout with its own arguments; return its exit status."""
    from stickslip.records.table import Content

    root = checkout()
    if root is None:
        raise ValueError(f"benchmark {name!r} needs {NEEDED}; accepted here: {PACKAGED}")
    if root != Path.cwd():
        print(f"in {root}", file=sys.stderr)
    path = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    command = [sys.executable, "-m", f"benchmarks.{name}", *arguments]
    ended = subprocess.run(command, cwd=root, env=os.environ | {"PYTHONPATH": path})
    return Content(status=ended.returncode)


def checkout() -> Path | None:
    """The project's root: the working directory, or where an editable install has its source.

    Other packages lay a folder named benchmarks beside theirs: ours stands beside src/stickslip.
    """
    for root in (Path.cwd(), Path(__file__).resolve().parents[2]):
        if (root / "benchmarks" / "report.py").exists() and (root / "src/stickslip").is_dir():
            return root
    return None
