"""The tables of what is promised: errors and statuses over the population."""

from __future__ import annotations

from typing import Any

from benchmarks.report import folded, markdown
from benchmarks.ugv.points import solver_name
from benchmarks.ugv.population import GROUND, VEHICLES, WHERE, WORDS
from benchmarks.ugv.promise import CONFIDENCE, QUANTILE

SHOWN = "PoseSolver(samples=0)"
"""The solver whose tables of waves are shown; the others' errors are the same but for tolerance."""


def promise_table(rows: list[dict[str, Any]]) -> str:
    """What each setting that is recommended promises; folded, every setting on the ground as it
    is, and tables with one solver."""
    kept = [r for r in rows if r["pieces_per_wave"] is None or r["solver"] == SHOWN]
    notes = [f"- {name}: {words}." for name, words in [*WORDS.items(), *WHERE.items()]]
    notes.append(f"- everywhere: {GROUND}; {VEHICLES}.")
    said = (
        f"Promised: at most the upper {100 * CONFIDENCE:.0f} % confidence bound of the "
        f"{100 * QUANTILE:g} % quantile, torque in weight times wheel radius, contact in wheel "
        "radii. A setting with a wrong status in its own sample (in brackets, how many) is never "
        "recommended there. Without the checks (`samples=0`) the adaptive solver is off by as much."
    )
    held = (
        "Held out: how many of as many other poses exceed a promise, and how many of their "
        "statuses are wrong."
    )
    every = folded("Every setting, with typical and worst errors", markdown(list(map(_line, kept))))
    return "\n\n".join([said, "\n".join(notes), markdown(_promised(kept)), held, every])


def _promised(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A line for each ground, solver and type that does not iterate a fixed number of times."""
    by_key: dict[tuple[str, str, str, str], dict[str, Any]] = {}
    for row in rows:
        solver, pieces = solver_name(row["solver"]), row["pieces_per_wave"]
        if "iteration" in solver or (pieces is None and solver == "adaptive, unchecked"):
            continue
        table = "-" if pieces is None else f"{pieces} a wave"
        by_key.setdefault((row["ground"], solver, table, row["dtype"]), {})[row["place"]] = row
    lines = []
    for (ground, solver, table, dtype), places in by_key.items():
        line = {"ground": ground, "solver": solver, "table": table, "type": dtype}
        for name in ("torque", "contact"):
            for place, row in places.items():
                wrong = f" ({row['wrong']})" if row["wrong"] else ""
                line[f"{name}, {place}"] = f"{row[name][1]:.1e}{wrong}"
        lines.append(line)
    return lines


def _line(row: dict[str, Any]) -> dict[str, Any]:
    pieces = row["pieces_per_wave"]
    (middle, bound, worst), contact = row["torque"], row["contact"]
    return {
        "ground": row["ground"],
        "place": row["place"],
        "solver": solver_name(row["solver"]),
        "table": "-" if pieces is None else f"{pieces} a wave",
        "type": row["dtype"],
        "poses": row["poses"],
        "torque: typical": f"{middle:.0e}",
        "promised": f"{bound:.1e}",
        "worst": f"{worst:.0e}",
        "contact: typical": f"{contact[0]:.0e}",
        "promised ": f"{contact[1]:.1e}",
        "worst ": f"{contact[2]:.0e}",
        "wrong": row["wrong"],
        "held out": f"{row['held_out_over']}, {row['held_out_wrong']}",
    }
