"""Errors and costs of the UGV's settings, which `stickslip.dynamics.ugv.recommendation` promises.

    python -m benchmarks.ugv [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.ugv --redraw

promise: errors and statuses of settings over random vehicles, ground and postures. costs: processor
time of a pose. Only the parts named are measured; the JSON keeps the other, with its commit.
--update also writes the module that `recommend` reads and the table of docs/drives.md;
--redraw does that without measuring.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.points import unbeaten
from benchmarks.report import (
    called,
    markdown,
    measured_by_command,
    put_between,
    rows_json,
    three,
    where,
)
from benchmarks.ugv.costs import costs
from benchmarks.ugv.population import AS_FUNCTION, PLACES
from benchmarks.ugv.promise import CONFIDENCE, QUANTILE, promises
from stickslip.records.files import write_whole


def promises_of(content: dict[str, Any]) -> list[dict[str, Any]]:
    """A promise of each setting on each kind of ground and place, with its costs by batch.

    ground, place, solver (as code), dtype, poses, torque and contact (errors: typical, promised,
    worst), wrong. The two kinds of function are pooled, the worse of both counting.
    """
    costs: dict[tuple, dict[int, float]] = {}
    for row in content["costs"]:
        key = (row["ground"], row["solver"], row["dtype"])
        costs.setdefault(key, {})[row["batch"]] = row["cost"]
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in content["promise"]:
        ground = "function" if row["ground"] in AS_FUNCTION else row["ground"]
        groups.setdefault((ground, *(row[name] for name in NAMES[1:])), []).append(row)

    def worst(rows: list[dict[str, Any]], name: str) -> list[float]:
        return [max(each) for each in zip(*(row[name] for row in rows), strict=True)]

    return [
        dict(zip(NAMES, names, strict=True))
        | {name: worst(rows, name) for name in ("torque", "contact")}
        | {name: sum(row[name] for row in rows) for name in ("poses", "wrong")}
        | {"costs": costs.get((names[0], *names[2:]), {})}
        for names, rows in groups.items()
    ]


def recommended(content: dict[str, Any]) -> list[dict[str, Any]]:
    """Promises of the settings that may be recommended.

    In some batch no other setting is cheaper and as accurate, of those that check as much: for
    hollow ground and clearance.
    """
    able = [p for p in promises_of(content) if p["wrong"] == 0 and p["costs"]]
    best: set[int] = set()
    for batch in {batch for p in able for batch in p["costs"]}:
        rated = {
            i: (
                (p["ground"], p["place"], p["dtype"], "samples=0" not in p["solver"]),
                (p["costs"][batch], p["torque"][1], p["contact"][1]),
            )
            for i, p in enumerate(able)
            if batch in p["costs"]
        }
        best |= unbeaten(rated)
    return [p for i, p in enumerate(able) if i in best]


def source(content: dict[str, Any]) -> str:
    """Text of dynamics/ugv/measured.json; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    promises, costs = [], {}
    for p in recommended(content):
        index = settings.setdefault((p["solver"], p["dtype"]), len(settings))
        errors = [_numbers(*p[name]) for name in ("torque", "contact")]
        promises.append([p["ground"], p["place"], index, p["poses"], *errors])
        costs |= {(p["ground"], index, batch): cost for batch, cost in p["costs"].items()}
    return rows_json(
        {
            "measured_on": where(content, "promise"),
            "quantile": QUANTILE,
            "confidence": CONFIDENCE,
            "settings": [[called(solver)[1], dtype] for solver, dtype in settings],
            "promises": promises,
            "costs": [[*key, three(cost)] for key, cost in sorted(costs.items())],
        }
    )


def _numbers(typical: float, *others: float) -> list[float | None]:
    """Errors to three digits, rounded up but for the median."""
    return [three(typical), *(three(1.005 * number) for number in others)]


def table(content: dict[str, Any]) -> str:
    """Promises of each recommended setting, with its cost in the largest batch."""
    lines: dict[tuple, dict[str, Any]] = {}
    columns = [f"{name}, {place}" for name in ("torque", "contact") for place in PLACES]
    for p in recommended(content):
        names = {"ground": p["ground"], "solver": p["solver"], "type": p["dtype"]}
        line = lines.setdefault(tuple(names.values()), names | dict.fromkeys(columns, "-"))
        for name in ("torque", "contact"):
            line[f"{name}, {p['place']}"] = f"{p[name][1]:.1e}"
        line["cost [s]"] = f"{p['costs'][max(p['costs'])]:.1e}"
    said = (
        f"Measured on {where(content, 'promise')}; costs: {where(content, 'costs')}. Torque in "
        "weight times wheel radius, contact in wheel radii; processor seconds for each of 16384 "
        "poses."
    )
    return f"{said}\n\n{markdown(list(lines.values()))}"


NAMES = ("ground", "place", "solver", "dtype")
"""What a promise is about."""
RESULTS = Path("benchmarks/results/ugv.json")
DOCUMENT = Path("docs/drives.md")
DATA = Path("dynamics/ugv/measured.json")
PARTS: dict[str, Any] = {"promise": promises, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend` and the page's table."""
    write_whole(DATA, source(content))
    put_between(DOCUMENT, table(content))


if __name__ == "__main__":
    measured_by_command("ugv", __doc__, PARTS, update)
