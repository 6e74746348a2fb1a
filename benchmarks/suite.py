"""The suite of instances: is one as it is recorded, and the page's table.

`python -m benchmarks.suite --docs docs/suite.md` writes the table into a page.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.report import markdown, put_between
from stickslip.optim import Instance, suite

SAME = 1e-6
"""Relative tolerance of a recorded value: roundings of another machine."""


def verified(instance: Instance) -> str:
    """ "as recorded", or what differs: the instance, its value, its feasibility."""
    known = instance.known
    if known is None or known.x is None:
        return "no point is recorded"
    if instance.digest() != known.digest:
        return "another instance than the recorded one: its numbers differ"
    found = [instance.value(one) for one in np.atleast_2d(known.x)]
    values = np.array([at[0] for at in found])
    wanted = known.value if known.front is None else known.front
    if not all(at[1] for at in found):
        return "the recorded point is not feasible"
    if not np.allclose(values, wanted, rtol=SAME, atol=SAME):
        return f"{values} at the recorded point, recorded {wanted}"
    return "as recorded"


def table() -> str:
    """Goal, best known value and gap of each instance."""
    rows: list[dict[str, Any]] = []
    for one in suite().values():
        known = one.known
        gap = best = ""
        if known is not None and not np.isnan(known.value):
            best = f"{known.value:.6g}"
        if known is not None and known.bound is not None:
            gap = f"{max(0.0, known.value - known.bound) / max(abs(known.value), 1e-12):.1g}"
        goal = ", ".join(one.goals)
        rows.append({"id": f"`{one.id}`", "goal": goal, "best known": best, "gap to a bound": gap})
    return markdown(rows)


if __name__ == "__main__":
    parser = ArgumentParser(prog="python -m benchmarks.suite")
    parser.add_argument("--docs", type=Path, required=True, help="put the table into this page")
    put_between(parser.parse_args().docs, f"\n{table()}\n", "suite")
