"""The measured tables of docs/ugv_tradeoff.md, between its markers."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.fronts import front_of, knee_of
from benchmarks.report import folded, markdown, where
from benchmarks.ugv.growth import exponent
from benchmarks.ugv.methods import CRITERIA, RUNS, SMALL, TOLERANCE
from benchmarks.ugv.points import (
    Point,
    ground_name,
    points_of,
    reliable,
    solver_name,
)
from benchmarks.ugv.promise_tables import promise_table
from benchmarks.ugv.trade import BATCHES, DENSITIES

SHOWN_BATCH = 65536
"""Whose rates are shown at first."""
SHOWN_FINER = "scp"
"""The method whose values are shown on the finer spacing, too."""


def body(content: dict[str, Any]) -> str:
    """All tables; of parts that have not been measured, nothing."""
    parts = []
    for name, title, show in (
        ("throughput", "Poses and equilibria a second", rates),
        ("promise", "Promises, setting by setting", promise_table),
        ("trade", "Fronts of the trade, on its own gentle tracks", fronts),
        ("trade", "Interpolation", interpolations),
        ("growth", "Dynamic programming: time", growths),
        ("grids", "Dynamic programming: value of the grid", grid_values),
        ("methods", "Methods on twelve tracks", summary),
        ("methods", "Values by track", values),
    ):
        if name in content:
            note = f"Measured on {where(content, name)}."
            parts += [f"### {title}", note, show(content[name])]
    return "\n\n".join(parts)


def rates(rows: list[dict[str, Any]]) -> str:
    """Each way's rates and errors, and how many times the plain loop's rate of a core it is; of
    other batches than SHOWN_BATCH folded."""
    loops = {row["track"]: row["per_core"] for row in rows if row["way"].startswith("plain")}
    lines = [
        {
            "track": row["track"],
            "way": row["way"],
            "type": row["dtype"],
            "batch": row["batch"],
            "per core-second": f"{row['per_core']:.2g}",
            "x loop": f"{row['per_core'] / loops[row['track']]:.3g}",
            "per second, as it was": f"{row['wall_rate']:.2g}",
            "compile [s]": f"{row['compile']:.1f}",
            "torque": f"{row['torque_error']:.0e}",
            "forces": f"{row['force_error']:.0e}",
            "contact [m]": f"{row['contact_error']:.0e}",
        }
        for row in rows
    ]
    shown = [line for line in lines if line["batch"] == SHOWN_BATCH or "loop" in line["way"]]
    return f"{markdown(shown)}\n\n{folded('Every batch', markdown(lines))}"


def fronts(rows: list[dict[str, Any]]) -> str:
    """Every front, of settings with the checks and of all, its knee marked."""
    lines = []
    for track in dict.fromkeys(row["track"] for row in rows):
        for batch in BATCHES:
            every = reliable(points_of(rows, track, batch))
            for checked in (True, False):
                points = [p for p in every if p.checked or not checked]
                if front_of(points):
                    lines += _front(points, track, batch, checked)
    return markdown(lines)


def _front(points: list[Point], track: str, batch: int, checked: bool) -> list[dict[str, Any]]:
    chosen = knee_of(points)
    return [
        {
            "track": track,
            "poses": batch,
            "checks": "with" if checked else "any",
            "solver": solver_name(p.solver),
            "ground": ground_name(p),
            "type": p.dtype,
            "torque error": f"{p.torque_error:.1e}",
            "contact error [m]": f"{p.contact_error:.1e}",
            "cost [s]": f"{p.cost:.1e}",
            "": "knee" if p is chosen else "",
        }
        for p in front_of(points)
    ]


def interpolations(rows: list[dict[str, Any]]) -> str:
    """The error of each kind of table by its pieces a metre: float64, adaptive, unchecked."""
    lines = []
    for track in dict.fromkeys(row["track"] for row in rows):
        for kind in ("quintic", "cubic", "makima", "pchip", "linear"):
            of = {
                row["pieces"]: row
                for row in rows
                if (row["track"], row["interpolation"], row["dtype"]) == (track, kind, "float64")
                and row["solver"] == "PoseSolver(samples=0)"
                and row["batch"] == BATCHES[-1]
            }
            if of:
                line: dict[str, Any] = {"track": track, "interpolation": kind}
                for n in DENSITIES:
                    line[f"{n}/m"] = f"{of[n]['torque_error']:.0e}" if n in of else "-"
                lines.append(line | {"cost [s]": f"{next(iter(of.values()))['cost']:.1e}"})
    return markdown(lines) if lines else "Not measured."


def growths(rows: list[dict[str, Any]]) -> str:
    """Times of both parts, and their exponents."""
    lines, notes = [], []
    for varied in ("angles", "waypoints"):
        of = [row for row in rows if row["varied"] == varied]
        lines += [
            {
                "angles": row["angles"],
                "waypoints": row["waypoints"],
                "moves": row["moves"],
                "stations [s]": f"{row['stations']:.3f}",
                "recursion [s]": f"{row['recursion']:.3f}",
                "first time [s]": f"{row['first']:.1f}",
            }
            for row in of
        ]
        sizes = [float(row[varied]) for row in of]
        found = {part: exponent(sizes, [row[part] for row in of])
                 for part in ("stations", "recursion")}  # fmt: skip
        notes.append(
            f"Exponent in the number of {varied}, upper half: stations {found['stations']:.2f}, "
            f"recursion {found['recursion']:.2f}."
        )
    return markdown(lines) + "\n\n" + "\n".join(notes)


def grid_values(rows: list[dict[str, Any]]) -> str:
    """How far dp's value lies above the best off the grid; each again on the finer spacing."""
    return markdown(
        [
            {
                "criterion": row["criterion"],
                "track": row["track"],
                "angles": row["angles"],
                "value": f"{row['value']:.6g}",
                "finer": _shown(row.get("finer")),
                "off the grid": f"{row['off_grid']:.6g}",
                "finer ": _shown(row.get("off_grid_finer")),
                "excess": f"{row['excess']:.1e}",
                "dp, wall [s]": f"{row['seconds']:.2f}",
            }
            for row in rows
        ]
    )


def summary(rows: list[dict[str, Any]]) -> str:
    """Each method over all tracks: how often feasible and best, its gaps, evaluations and time."""
    lines = []
    for criterion in CRITERIA:
        for name in RUNS:
            of = [r for r in rows if (r["criterion"], r["method"]) == (criterion, name)]
            good = [r for r in of if r["gap"] is not None]
            if of:
                gaps, over = ([r[key] for r in good] for key in ("gap", "over_dp"))
                finer = [by for r in good if (by := spacing_error(r)) is not None]
                lines.append(
                    {
                        "criterion": criterion,
                        "method": name,
                        "feasible": f"{len(good)} of {len(of)}",
                        "best": sum(gap <= TOLERANCE for gap in gaps),
                        "gap": _middle_and_worst(gaps),
                        "over dp's grid": _middle_and_worst(over),
                        "finer spacing": _middle_and_worst(finer),
                        "evaluations": f"{np.median([r['evaluations'] for r in of]):.0f}",
                        "seconds": f"{np.median([r['seconds'] for r in of]):.2f}",
                    }
                )
    return markdown(lines)


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"


def spacing_error(row: dict[str, Any]) -> float | None:
    """By how much the value on the finer spacing differs, in parts of the straight legs' value."""
    if row.get("finer") is None:
        return None
    return abs(row["finer"] - row["value"]) / max(row["straight"], SMALL)


def _middle_and_worst(values: list[float]) -> str:
    return f"{100 * np.median(values):.2f} % ({100 * max(values):.2f} %)" if values else "-"


def values(rows: list[dict[str, Any]]) -> str:
    """Every value; in brackets what breaks a constraint."""
    lines = []
    for criterion in CRITERIA:
        for track in dict.fromkeys(row["track"] for row in rows):
            line: dict[str, Any] = {"criterion": criterion, "track": track}
            for name in RUNS:
                for r in rows:
                    if (r["criterion"], r["track"], r["method"]) == (criterion, track, name):
                        text = "-" if r["value"] is None else f"{r['value']:.5g}"
                        line[name] = text if r["feasible"] else f"({text})"
                        if name == SHOWN_FINER:
                            line[f"{name}, finer"] = _shown(r.get("finer"))
            lines.append(line)
    return markdown(lines)
