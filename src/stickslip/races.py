"""`stickslip bench run | report | methods`: races of optimisers on the suite, and their results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stickslip.agents.optimisers import report
from stickslip.agents.optimisers.methods import METHODS, methods_table
from stickslip.agents.optimisers.racing import race
from stickslip.agents.sweeps.cells import StoppedError
from stickslip.optim import suite
from stickslip.records.files import require_folder, write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

ASKED = ("out", "budget", "seconds", "seeds", "resume", "workers", "limit")
"""Flags that `race` takes by their names."""


def run_command(flags: Mapping[str, Any]) -> Content:
    """Run methods on instances into a directory."""
    require_folder(flags["out"])
    methods, names = flags["methods"] or list(METHODS), flags["instances"] or list(suite())
    given = {name: flags[name] for name in ASKED}
    with stoppable() as stop:
        try:
            runs = race(methods, names, **given, progress=True, stop=stop)
        except StoppedError:
            message = f"Stopped; go on with the same command and --resume ({flags['out']})"
            raise stop.interrupted(message) from None
    print(report.counted_text(runs), end="")
    print(f"Compare them: stickslip bench report {flags['out']} --out DIR")
    return Content({"runs": report.runs_table(runs)}, {"directory": flags["out"]})


def report_command(flags: Mapping[str, Any]) -> Content:
    """Compare runs: tables, ECDF plots."""
    out = Path(flags["out"])
    require_folder(out)
    if out.exists():
        raise ValueError(f"{out} exists; accepted: a new directory")
    runs = report.read_results(*flags["source"])
    text = report.report_text(runs)
    print(text)
    written = [write_whole(out / "report.md", text, overwrite=False)]
    written.append(write_whole(out / "runs.csv", report.runs_table(runs).csv(), overwrite=False))
    written += report.draw_ecdfs(runs, out)
    print("Written: " + ", ".join(map(str, written)))
    return Content({"runs": report.runs_table(runs)}, {"written": [str(one) for one in written]})


def methods_command(_: Mapping[str, Any]) -> Content:
    """List the methods."""
    table = methods_table()
    print(table.terminal())
    return Content({"methods": table})
