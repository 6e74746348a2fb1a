"""List and run benchmarks (`stickslip bench`).

Those of the package run in this process. Those of the repository's folder benchmarks/ need a
checkout, and each runs in a process of its own, which loads nothing but what it measures.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from stickslip.dynamics.plain_checks import require_choice

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.records.table import Content

PACKAGE = "stickslip"


class Benchmark(NamedTuple):
    """module: its name; of the package, it has run(arguments) -> exit status, what was found."""

    module: str
    about: str

    @property
    def packaged(self) -> bool:
        """Whether it comes with the package."""
        return self.module.partition(".")[0] == PACKAGE


BENCHMARKS = {
    "optimisers": Benchmark(
        "stickslip.agents.optimisers.commands", "optimisers on the suite's instances"
    ),
    "bounds": Benchmark("benchmarks.bounds", "what no drive of the UGV can beat"),
    "gaits": Benchmark("benchmarks.gaits", "the biped's best gaits"),
    "peers": Benchmark("benchmarks.peers", "the same walks in MuJoCo"),
    "policies": Benchmark("benchmarks.policies", "the trained policies of the package"),
    "size": Benchmark("benchmarks.size", "lines, flags, and files that a call enters"),
    "suite": Benchmark("benchmarks.suite", "best known values and bounds of the suite"),
    "tasks": Benchmark("benchmarks.tasks", "what is earned on each task"),
    "throughput": Benchmark("benchmarks.throughput", "environment steps a second"),
    "tradeoff": Benchmark("benchmarks.tradeoff", "the biped's speed against accuracy"),
    "training": Benchmark("benchmarks.training", "PPO on every task"),
    "ugv": Benchmark("benchmarks.ugv", "the UGV's speed against accuracy, and its methods"),
}
"""By name, a line each."""


def bench_command(flags: Mapping[str, Any]) -> Content:
    """List the benchmarks, or run one. --json may stand behind its name, too."""
    if flags["name"] is None:
        return list_benchmarks()
    arguments = [one for one in flags["rest"] if one != "--json"]
    as_json = flags["json"] or len(arguments) < len(flags["rest"])
    return run_benchmark(flags["name"], arguments, as_json=as_json)


def list_benchmarks() -> Content:
    """Print a table of all, and what is needed for those that do not run here; return it."""
    from stickslip.records.table import Column, Content, Table

    root = checkout()
    heads = [Column(name, words=True) for name in ("benchmark", "runs here", "about")]
    rows = [[name, runs_here(one, root), one.about] for name, one in BENCHMARKS.items()]
    shown = [[name, "yes" if here else "no", about] for name, here, about in rows]
    print(Table(heads, shown).terminal())
    if root is None:
        print(f"The others need a checkout of the project: {HOW}")
    table = Table([*heads[:1], Column("runs_here"), *heads[2:]], rows)
    where = None if root is None else str(root)
    return Content({"benchmarks": table}, {"checkout": where})


HOW = (
    "clone its repository, install it there with `pip install -e .[bench]`, and run `stickslip "
    "bench NAME` in that folder"
)


def run_benchmark(name: str, arguments: Sequence[str], *, as_json: bool = False) -> Content:
    """Run a benchmark with its own arguments; return its content, exit status included.

    ValueError for an unknown name, for one that cannot run here and, with as_json, for one that
    writes its own JSON.
    """
    from stickslip.records.table import Content

    require_choice("benchmark", name, BENCHMARKS)
    one, root = BENCHMARKS[name], checkout()
    if one.packaged:
        if not runs_here(one, root):
            raise ValueError(f"benchmark {name!r} is not in this version of the package")
        status, found = import_module(one.module).run(list(arguments))
        return replace(found or Content(), status=status)
    if as_json:
        raise ValueError(f"benchmark {name!r} writes its own JSON; accepted: --out FILE")
    if root is None:
        here = ", ".join(name for name, one in BENCHMARKS.items() if runs_here(one, None))
        raise ValueError(
            f"benchmark {name!r} needs a checkout of the project, and neither this folder nor the "
            f"package is in one; {HOW}" + (f"; accepted here: {here}" if here else "")
        )
    if root != Path.cwd():
        print(f"in {root}", file=sys.stderr)
    path = os.pathsep.join(filter(None, (str(root), os.environ.get("PYTHONPATH"))))
    ended = subprocess.run(
        [sys.executable, "-m", one.module, *arguments],
        cwd=root,
        env=os.environ | {"PYTHONPATH": path},
    )
    return Content(status=ended.returncode)


def runs_here(one: Benchmark, root: Path | None) -> bool:
    """Whether it can be run: a module of the package that is there, or one of the checkout."""
    if not one.packaged:
        return root is not None
    try:
        return find_spec(one.module) is not None
    except ModuleNotFoundError:
        return False


def checkout() -> Path | None:
    """The project's root: the working directory, or where an editable install has its source.

    Other packages lay a folder named benchmarks beside theirs: ours stands beside src/stickslip.
    """
    for root in (Path.cwd(), Path(__file__).resolve().parents[2]):
        if (root / "benchmarks" / "report.py").exists() and (root / "src" / PACKAGE).is_dir():
            return root
    return None
