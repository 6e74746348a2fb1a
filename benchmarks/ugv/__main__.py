"""Errors and costs of the UGV's settings, which `stickslip.dynamics.ugv.recommendation` promises.

    python -m benchmarks.ugv [--quick] [--update] [--only PART ...] [--out FILE]
    python -m benchmarks.ugv --redraw

promise: errors and statuses of settings over random vehicles, ground and postures. costs: processor
time of a pose. Only the parts named are measured; the JSON keeps the other, with its commit.
--update also writes the module that `recommend` reads and the table of docs/drives.md;
--redraw does that without measuring.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

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
from benchmarks.ugv.population import AS_FUNCTION
from benchmarks.ugv.promise import CONFIDENCE, QUANTILE, promises
from stickslip.records.files import write_whole


class Promise(NamedTuple):
    """A setting on a kind of ground; the solver as code. Errors: typical, promised, worst."""

    ground: str
    place: str
    solver: str
    dtype: str
    poses: int
    torque: tuple[float, float, float]
    contact: tuple[float, float, float]
    wrong: int
    cost: float = 0.0

    @property
    def error(self) -> float:
        """The worse of both promised errors [-]."""
        return max(self.torque[1], self.contact[1])

    @property
    def checked(self) -> bool:
        """True if it looks for hollow ground and computes the clearance."""
        return "samples=0" not in self.solver


def promises_of(rows: list[dict[str, Any]]) -> list[Promise]:
    """Promises of all rows; the two kinds of function are pooled, the worse of both counting."""
    found = [
        Promise(
            *(row[name] for name in Promise._fields[:5]),
            torque=tuple(row["torque"]),
            contact=tuple(row["contact"]),
            wrong=row["wrong"],
        )
        for row in rows
    ]
    kinds: dict[tuple, list[Promise]] = {}
    for p in found:
        if p.ground in AS_FUNCTION:
            kinds.setdefault(p[1:4], []).append(p)
    own = [p for p in found if p.ground not in AS_FUNCTION]
    return own + [_pooled(same) for same in kinds.values() if len(same) == len(AS_FUNCTION)]


def _pooled(same: list[Promise]) -> Promise:
    def worst(name: str) -> tuple:
        return tuple(max(each) for each in zip(*(getattr(p, name) for p in same), strict=True))

    return same[0]._replace(
        ground="function",
        poses=sum(p.poses for p in same),
        torque=worst("torque"),
        contact=worst("contact"),
        wrong=sum(p.wrong for p in same),
    )


def costs_of(rows: list[dict[str, Any]]) -> Callable[[Promise], dict[int, float]]:
    """A function from a promise to its processor seconds for each measured batch."""
    table: dict[tuple, dict[int, float]] = {}
    for row in rows:
        key = (row["ground"], row["solver"], row["dtype"])
        table.setdefault(key, {})[row["batch"]] = row["cost"]

    def costs(point: Promise) -> dict[int, float]:
        return table.get((point.ground, point.solver, point.dtype), {})

    return costs


def recommended(content: dict[str, Any]) -> list[tuple[Promise, dict[int, float]]]:
    """Settings that may be recommended, with their cost for each batch."""
    costs = costs_of(content["costs"])
    able = [p for p in promises_of(content["promise"]) if p.wrong == 0 and costs(p)]
    best = set()
    for batch in dict.fromkeys(batch for p in able for batch in costs(p)):
        priced = [p._replace(cost=costs(p)[batch]) for p in able if batch in costs(p)]
        best |= {
            p._replace(cost=0.0)
            for p in unbeaten(
                priced,
                lambda p: (p.torque[1], p.contact[1]),
                lambda p: (p.ground, p.place, p.dtype, p.checked),
            )
        }
    return [(p, costs(p)) for p in able if p in best]


def source(content: dict[str, Any]) -> str:
    """Text of dynamics/ugv/measured.json; the same content gives the same text."""
    settings: dict[tuple, int] = {}
    promises, costs = [], {}
    for point, priced in recommended(content):
        index = settings.setdefault((point.solver, point.dtype), len(settings))
        errors = [_numbers(errors) for errors in (point.torque, point.contact)]
        promises.append([point.ground, point.place, index, point.poses, *errors])
        costs |= {(point.ground, index, batch): cost for batch, cost in priced.items()}
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


def _numbers(errors: tuple[float, float, float]) -> list[float | None]:
    """Errors to three digits, rounded up but for the median."""
    typical, *others = errors
    return [three(typical), *(three(1.005 * number) for number in others)]


def table(content: dict[str, Any]) -> str:
    """Promises of each recommended setting, with its cost in the largest batch."""
    lines: dict[tuple, dict[str, Any]] = {}
    for point, priced in recommended(content):
        key = point.ground, point.solver, point.dtype
        line = lines.setdefault(
            key,
            {
                "ground": point.ground,
                "solver": point.solver,
                "type": point.dtype,
                **dict.fromkeys(("torque, near", "torque, far", "contact, near"), "-"),
                **dict.fromkeys(("contact, far", "cost [s]"), "-"),
            },
        )
        for name in ("torque", "contact"):
            line[f"{name}, {point.place}"] = f"{getattr(point, name)[1]:.1e}"
        line["cost [s]"] = f"{priced[max(priced)]:.1e}"
    said = (
        f"Measured on {where(content, 'promise')}; costs: {where(content, 'costs')}. Torque in "
        "weight times wheel radius, contact in wheel radii; processor seconds for each of 16384 "
        "poses."
    )
    return f"{said}\n\n{markdown(list(lines.values()))}"


RESULTS = Path("benchmarks/results/ugv.json")
DOCUMENT = Path("docs/drives.md")
DATA = Path("dynamics/ugv/measured.json")
PARTS: dict[str, Any] = {"promise": promises, "costs": costs}


def update(content: dict[str, Any]) -> None:
    """Write the data of `recommend` and the page's table."""
    write_whole(DATA, source(content))
    put_between(DOCUMENT, table(content))


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    measured_by_command("ugv", __doc__, PARTS, update, arguments)


if __name__ == "__main__":
    main()
