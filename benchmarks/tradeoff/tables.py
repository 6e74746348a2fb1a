"""The measured tables of docs/tradeoff.md, between its markers."""

from __future__ import annotations

import re
from typing import Any

from benchmarks.fronts import front_of, knee_of
from benchmarks.report import markdown, where
from benchmarks.tradeoff.measure import CHECK
from benchmarks.tradeoff.points import (
    COSTS,
    Point,
    fidelity_name,
    integrator_name,
    point_of,
    points_of,
)
from stickslip.dynamics.biped.settings import PRESET_BATCH, PRESET_SCENE, preset_indices


def body(content: dict[str, Any]) -> str:
    """All tables."""
    rows = content["rows"]
    off = content["checks"][CHECK]
    parts = [f"Measured on {where(content)}."]
    if off is not None:
        parts.append(
            "The long walk's reference, beside a quadrature that uses none of the integrators, is "
            f"off by {off:.1e} rad after its 400 s."
        )
    parts += ["### Presets", presets(rows), "### The fronts", fronts(rows)]
    parts += ["### Fidelities", fidelities(rows), "### Integrators", integrators(rows)]
    parts += ["### Compile time and memory", programs(content["programs"])]
    return "\n\n".join(parts)


def presets(rows: list[dict[str, Any]]) -> str:
    """The presets, their errors and costs."""
    points = points_of(rows, PRESET_SCENE, PRESET_BATCH)
    if not front_of(points):
        return "Not measured."
    chosen = preset_indices([p.cost for p in points], [p.error for p in points])
    lines = [{"preset": name} | _columns(points[index]) for name, index in chosen.items()]
    return markdown(lines)


def fronts(rows: list[dict[str, Any]]) -> str:
    """Every point of every front, its knee marked."""
    lines = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        for batch in COSTS:
            points = points_of(rows, scene, batch)
            if not front_of(points):
                continue
            knee = knee_of(points)
            lines += [_front_line(scene, batch, p, p is knee) for p in front_of(points)]
    return markdown(lines)


def _front_line(scene: str, batch: int, point: Point, knee: bool) -> dict[str, Any]:
    mark = {"": "knee" if knee else ""}
    return {"scene": scene, "environments": batch} | _columns(point) | mark


def _columns(point: Point) -> dict[str, Any]:
    return {
        "fidelity": fidelity_name(point.fidelity),
        "integrator": integrator_name(point),
        "type": point.dtype,
        "error [rad/s]": f"{point.error:.1e}",
        "cost [s/s]": f"{point.cost:.1e}",
    }


def fidelities(rows: list[dict[str, Any]], scene: str = PRESET_SCENE) -> str:
    """The same scene and step size with every fidelity, in double precision."""
    chosen = [
        row
        for row in rows
        if row["scene"] == scene
        and row["dtype"] == "float64"
        and row["dt"] in (0.02, 0.005)
        and (row["integrator"] == "RK4Split()" or row["fidelity"].startswith("Paper"))
    ]
    lines = [
        {
            "fidelity": fidelity_name(row["fidelity"]),
            "integrator": integrator_name(point_of(row)),
            "error [rad/s]": _number(row["angle_error"] and point_of(row).error),
            "cost, 1 [s/s]": _number(row["cost_1"]),
            "cost, batch [s/s]": _number(row.get("cost_4096")),
            "batch": row.get("batch_measured", "-"),
        }
        for row in chosen
    ]
    return markdown(lines) if lines else "Not measured."


def integrators(rows: list[dict[str, Any]]) -> str:
    """How well each integrator finds the switching instants of the walks that slip."""
    lines = [
        {
            "scene": row["scene"],
            "integrator": integrator_name(point_of(row)),
            "error [rad/s]": _number(row["angle_error"] and point_of(row).error),
            "events": f"{row['events_alike']} of {row['events_wanted']}",
            "off by [s]": _number(row["event_error"]),
            "balance [J]": _number(row["energy_error"]),
            "normal force": _number(row["normal_error"]),
            "friction": _number(row["friction_error"]),
            "cost, 1 [s/s]": _number(row["cost_1"]),
        }
        for row in rows
        if row.get("event_error") is not None
    ]
    return markdown(lines) if lines else "Not measured."


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def programs(found: list[dict[str, Any]]) -> str:
    """Compile seconds and memory on the floor that slips (or whichever was measured)."""
    slips = [p for p in found if p["structure"] == "uniform"] or found
    lines = []
    for program in slips:
        batch = program["batch"]
        lines.append(
            {
                "fidelity": fidelity_name(program["fidelity"]),
                "integrator": re.sub(r"[, ]*atol=[^,)]*", "", program["integrator"]),
                "type": program["dtype"],
                "coefficients [kB]": f"{program['coefficient_bytes'] / 1e3:.1f}",
                "compile, one [s]": f"{program['compile_1']:.1f}",
                "memory, one [kB]": f"{program['bytes_1'] / 1e3:.0f}",
                "batch": batch or "-",
                "compile, batch [s]": f"{program['compile_batch']:.1f}" if batch else "-",
                "memory, batch [MB]": f"{program['bytes_batch'] / 1e6:.1f}" if batch else "-",
            }
        )
    return markdown(lines)
