"""The same walks in other programs: simulated seconds a second at equal accuracy.

    python -m benchmarks.peers [--quick] [--only NAME ...] [--out FILE] [--figure FILE]

stickslip, MuJoCo, MJX, Pinocchio and a C loop over stickslip's table, each at several settings, in
one run (see docs/peers.md). What is not installed is left out and named: MuJoCo and MJX come with
the extra `bench`, Pinocchio with `peers`, the loop needs a C compiler.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jax

from benchmarks.peers import c_loop, mjx_batches, mujoco_c, ours, pinocchio_loops
from benchmarks.peers.cases import BOUNDS, CASES, Case, Measured, check_reference, reference
from benchmarks.peers.summary import aims, at_bounds, draw
from benchmarks.report import markdown, options, provenance, write_json

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks/results/peers.json"
PROGRAMS: dict[str, tuple[Callable[[Case, bool], Iterator[Measured]], str]] = {
    ours.NAME: (ours.measure, "jax"),
    mujoco_c.NAME: (mujoco_c.measure, "mujoco"),
    pinocchio_loops.NAME: (pinocchio_loops.measure, "pinocchio"),
    mjx_batches.NAME: (mjx_batches.measure, "mujoco.mjx"),
}
"""What measures a program on a case, and the module that it needs."""


def versions() -> dict[str, str]:
    """Of the peers that are there, and of the C compiler."""
    found = {}
    for name in ("mujoco", "mujoco-mjx", "pin"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    compiler = c_loop.compiler()
    if compiler is not None:
        said = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False)
        found["C compiler"] = said.stdout.splitlines()[0] if said.stdout else compiler
    return found


def installed(module: str) -> bool:
    """Whether a module can be imported, without importing more than its parent."""
    try:
        return find_spec(module) is not None
    except ModuleNotFoundError:
        return False


def measurements(only: list[str], quick: bool) -> Iterator[Measured]:
    """Every program on every case, one measurement at a time; the C loop last."""
    for case in CASES:
        for name, (measure, module) in PROGRAMS.items():
            if name in only and installed(module):
                yield from measure(case, quick)
    if c_loop.NAME in only:
        yield from c_loop.measure(quick)


def main(arguments: list[str] | None = None) -> None:
    """Measure, print the tables, write the JSON and the figure."""
    names = [*PROGRAMS, c_loop.NAME]
    parser = options("peers", __doc__, RESULTS)
    parser.add_argument("--quick", action="store_true", help="fewer settings and repeats")
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="NAME")
    parser.add_argument("--figure", type=Path, default=ROOT / "docs/peers.png")
    given = parser.parse_args(arguments)
    jax.config.update("jax_enable_x64", True)
    absent = [name for name, (_, module) in PROGRAMS.items() if not installed(module)]
    absent += [] if c_loop.compiler() else [c_loop.NAME]
    if absent:
        print(f"Not here, so left out: {', '.join(absent)}")
    print("Reference: exact inertia functions, float64, steps of 0.1 ms", flush=True)
    check = check_reference(ROOT / "tests/reference/biped_default.json")
    print(f"  differs from the reference file's first walk by {check['difference']:.1e} rad")
    wanted = {case.name: reference(case)[0].tolist() for case in CASES}
    rows: list[Measured] = []
    for row in measurements(given.only, given.quick):
        rows.append(row)
        print(
            f"{row.case:16s} {row.program:10s} {row.batch:5d} {row.threads} {row.setting:52s} "
            f"{row.error:8.1e} rad {row.rate:10,.1f} s/s  {row.core_rate:10,.1f} a core {row.note}",
            flush=True,
        )
    table = at_bounds(rows, BOUNDS)
    print("\n" + markdown(table) + "\n" if table else "")
    reached = aims(rows)
    for line in reached:
        print(line["aim"] + ": " + line["measured"])
    content: dict[str, Any] = {**provenance()}
    content["versions"] |= versions()
    content |= {"absent": absent, "reference": check, "reference_angles": wanted}
    content |= {"at_bounds": table, "aims": reached, "rows": [row.row() for row in rows]}
    write_json(content, given.out)
    draw(rows, given.figure)
    print(f"Written to {given.out} and {given.figure}")


if __name__ == "__main__":
    main()
