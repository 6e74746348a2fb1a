"""MuJoCo beside stickslip: speed at equal accuracy, and creep of a contact that sticks.

    python -m benchmarks.peers [--quick] [--update] [--out FILE]

stickslip and MuJoCo (extra `bench`), each at several settings, in one run. --update also writes the
table of docs/performance.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jax

from benchmarks.peers.creep import creep_rows
from benchmarks.peers.programs import BOUNDS, CASES, mujoco_rows, stickslip_rows
from benchmarks.report import markdown, measured_by_command, put_between, where

RESULTS = Path("benchmarks/results/peers.json")
DOCUMENT = Path("docs/performance.md")


def rows(quick: bool) -> Iterator[dict[str, Any]]:
    """Every setting of both programs on both walks."""
    for case in CASES:
        yield from stickslip_rows(case, quick)
        yield from mujoco_rows(case, quick)


def at_bounds(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Simulated seconds a core-second by the fastest setting that meets each accuracy."""
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["case"], row["program"], row["batch"]), []).append(row)
    table = []
    for (case, program, batch), group in groups.items():
        line = {"walk": case, "program": program, "batch": batch}
        for bound in BOUNDS:
            meet = [row for row in group if row["error"] is not None and row["error"] <= bound]
            best = max(meet, key=lambda row: row["core_rate"], default=None)
            least = min(row["error"] for row in group if row["error"] is not None)
            line[f"{bound:g} rad"] = (
                f"not reached ({least:.1e})"
                if best is None
                else f"{_short(best['core_rate'])} ({best['setting']})"
            )
        table.append(line)
    return table


def body(content: dict[str, Any]) -> str:
    """The table of docs/performance.md."""
    return f"Measured on {where(content, 'rows')}.\n\n{markdown(at_bounds(content['rows']))}"


def creep(content: dict[str, Any]) -> str:
    """The table of creeping contacts of docs/performance.md."""
    lines = [row | {"creep": f"{row['creep']:.3g} um/s"} for row in content["creep"]]
    return f"Measured on {where(content, 'creep')}.\n\n{markdown(lines)}"


def _short(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def update(content: dict[str, Any]) -> None:
    """Write the page's table."""
    put_between(DOCUMENT, body(content), "peers")
    put_between(DOCUMENT, creep(content), "creep")


def main(arguments: list[str] | None = None) -> None:
    """Run the command, and print the table."""
    jax.config.update("jax_enable_x64", True)
    parts = {"rows": rows, "creep": creep_rows}
    content = measured_by_command("peers", __doc__, parts, update, arguments)
    print(body(content), creep(content), sep="\n\n")


if __name__ == "__main__":
    main()
