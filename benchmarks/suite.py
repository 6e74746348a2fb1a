"""The table of the suite's instances.

`python -m benchmarks.suite --docs docs/suite.md` writes the table into a page.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import markdown, put_between
from stickslip.optim import suite


def table() -> str:
    """Goal, best known value and gap of each instance."""
    rows: list[dict[str, Any]] = []
    for one in suite().values():
        known: Any = one.known
        best = "" if np.isnan(known.value) else f"{known.value:.6g}"
        gap = ""
        if known.bound is not None:
            gap = f"{max(0.0, known.value - known.bound) / max(abs(known.value), 1e-12):.1g}"
        goal = ", ".join(one.goals)
        rows.append({"id": f"`{one.id}`", "goal": goal, "best known": best, "gap to a bound": gap})
    return markdown(rows)


if __name__ == "__main__":
    parser = ArgumentParser(prog="python -m benchmarks.suite")
    parser.add_argument("--docs", type=Path, required=True, help="put the table into this page")
    put_between(parser.parse_args().docs, f"\n{table()}\n", "suite")
