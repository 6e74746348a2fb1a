"""The measured tables of docs/tradeoff.md, between its markers."""

from __future__ import annotations

import math
import re
from typing import Any

from benchmarks.fronts import front_of, knee_of
from benchmarks.report import folded, markdown, where
from benchmarks.tradeoff.measure import CHECK
from benchmarks.tradeoff.points import (
    COSTS,
    Promise,
    cost_of,
    fidelity_name,
    integrator_name,
    point_of,
    promises_of,
)
from benchmarks.tradeoff.population import FLOORS, ROBOTS
from stickslip.dynamics.biped.trade.settings import PRESET_BATCH, PRESET_SCENE, preset_indices


def body(content: dict[str, Any]) -> str:
    """All tables."""
    walks = content["walks"]
    rows = walks["rows"]
    off = walks["checks"][CHECK]
    parts = [
        f"Promises: {where(content, 'population')}.",
        f"Costs and single walks: {where(content, 'walks')}{_completed(content)}.",
    ]
    if off is not None:
        parts.append(
            "The long walk's reference, beside a quadrature that uses none of the integrators, is "
            f"off by {off:.1e} rad after its 400 s."
        )
    parts += ["### The sample", samples(content), "### Presets", presets(content)]
    parts += ["### The fronts", fronts(content), "### Promises"]
    parts.append(folded("Every setting: what half, 95 % and 99 % of the walks keep, in rad/s",
                        promises(content)))  # fmt: skip
    parts += ["### Fidelities", fidelities(rows), "### Integrators"]
    parts.append(folded("Every integrator: how well it finds the switching instants",
                        integrators(rows)))  # fmt: skip
    parts += ["### Compile time and memory", programs(walks["programs"])]
    return "\n\n".join(parts)


def _completed(content: dict[str, Any]) -> str:
    """Where most of it comes from, if the last run only added what was missing."""
    before = content["parts"]["walks"].get("completes")
    if before is None:
        return ""
    return f", completing what commit {before['commit']} measured on {before['measured'][:10]}"


def samples(content: dict[str, Any]) -> str:
    """What the walks of the population are like."""
    lines = [
        {
            "floor": s["scene"],
            "robots": s["robots"],
            "walks": s["count"],
            "too short": s["too_short"],
            "leave the model": f"{100 * s['left']:.0f} %",
            "switches": f"{s['switches']:.0f}",
            "differentiated": s["derived"],
            "sensitivity: median": f"{s['sensitivity'][0]:.2g}",
            "95 %": f"{s['sensitivity'][1]:.2g}",
            "largest": f"{s['sensitivity'][2]:.2g}",
            "above 1e3": f"{100 * s['sensitive']:.0f} %",
        }
        for s in content["population"]["samples"]
    ]
    return markdown(lines) if lines else "Not measured."


def presets(content: dict[str, Any]) -> str:
    """The presets, what is promised of them, and their costs."""
    points = promises_of(content, PRESET_SCENE, ROBOTS[0], PRESET_BATCH)
    if not front_of([p for p in points if p.dtype == "float32"]):
        return "Not measured."
    columns = zip(*((p.cost, p.error, p.dtype) for p in points), strict=True)
    chosen = preset_indices(*columns)
    return markdown([{"preset": name} | _columns(points[i]) for name, i in chosen.items()])


def fronts(content: dict[str, Any]) -> str:
    """Every point of every front of the default robot, its knee marked."""
    lines = []
    for scene in FLOORS:
        for batch in COSTS:
            points = promises_of(content, scene, ROBOTS[0], batch)
            if not front_of(points):
                continue
            knee = knee_of(points)
            for point in front_of(points):
                mark = {"": "knee" if point is knee else ""}
                lines.append({"floor": scene, "environments": batch} | _columns(point) | mark)
    return markdown(lines) if lines else "Not measured."


def promises(content: dict[str, Any]) -> str:
    """Every setting: what half, 95 % and 99 % of the walks keep."""
    lines = []
    for scene in FLOORS:
        own, other = (promises_of(content, scene, robots, 1) for robots in ROBOTS)
        for one, two in zip(_by_step(own), _by_step(other), strict=True):
            lines.append(
                {
                    "floor": scene,
                    "fidelity": fidelity_name(one.fidelity),
                    "integrator": integrator_name(one),
                    "type": one.dtype,
                    "50 %": _number(one.typical),
                    "95 %": _number(one.error),
                    "99 %": _number(one.bounds["0.99"][0]),
                    "others: 50 %": _number(two.typical),
                    "others: 95 %": _number(two.error),
                    "others: 99 %": _number(two.bounds["0.99"][0]),
                    "end otherwise": f"{100 * max(one.otherwise, two.otherwise):.1f} %",
                    "other switches": f"{100 * max(one.other_switches, two.other_switches):.1f} %",
                }
            )
    return markdown(lines) if lines else "Not measured."


def _by_step(points: list[Promise]) -> list[Promise]:
    return sorted(points, key=lambda p: (p.integrator, p.dtype, -p.dt, p.fidelity))


def _columns(point: Promise) -> dict[str, Any]:
    return {
        "fidelity": fidelity_name(point.fidelity),
        "integrator": integrator_name(point),
        "type": point.dtype,
        "typical [rad/s]": _number(point.typical),
        "promised [rad/s]": _number(point.error),
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
            "cost, 1 [s/s]": _number(cost_of(row, 1)),
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
            "cost, 1 [s/s]": _number(cost_of(row, 1)),
        }
        for row in rows
        if row.get("event_error") is not None
    ]
    return markdown(lines) if lines else "Not measured."


def _number(value: float | None) -> str:
    return "-" if value is None or math.isinf(value) else f"{value:.1e}"


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
