"""Rows of the measurement as points of cost and error."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from benchmarks.fronts import unbeaten
from stickslip.dynamics.biped.settings import WALK_PER_RADIAN

COSTS = {1: "cost_1", 4096: "cost_4096"}
"""Environments stepped together, and the column of their cost."""


class Point(NamedTuple):
    """One setting in one scene and batch, its names as code."""

    fidelity: str
    integrator: str
    dt: float
    dtype: str
    angle_error: float
    slide_error: float
    cost: float

    @property
    def setting(self) -> tuple[str, str, float, str]:
        """Without what was measured."""
        return self[:4]

    @property
    def error(self) -> float:
        """The worse of both [rad/s]; as stickslip.dynamics.biped.settings.Measurement has it."""
        return max(self.angle_error, self.slide_error / WALK_PER_RADIAN)


def points_of(rows: list[dict[str, Any]], scene: str, batch: int) -> list[Point]:
    """All points of a scene and batch that stayed within the model."""
    return [
        point_of(row, batch)
        for row in rows
        if row["scene"] == scene and row["angle_error"] is not None and COSTS[batch] in row
    ]


def point_of(row: dict[str, Any], batch: int = 1) -> Point:
    """One row, its cost that of the batch."""
    return Point(*(row[name] for name in Point._fields[:6]), cost=row[COSTS[batch]])


def undominated(points: list[Point]) -> list[Point]:
    """Points that none of the same precision beats in cost, angle and slide: `recommend`'s."""
    kept = unbeaten(points, lambda p: (p.angle_error, p.slide_error), lambda p: p.dtype)
    return sorted(kept, key=lambda p: p.cost)


def short(point: Point) -> str:
    """A label for a picture or a table: table 32x7, rk4_split, 5 ms, float32."""
    return f"{fidelity_name(point.fidelity)}, {integrator_name(point)}, {point.dtype}"


def fidelity_name(fidelity: str) -> str:
    """Out of its code: Table(pieces=32, degree=7) is table 32x7."""
    name, numbers = fidelity.split("(")[0].lower(), re.findall(r"=([^,)]+)", fidelity)
    return " ".join([name, "x".join(numbers)]) if numbers else name


def integrator_name(point: Point) -> str:
    """With its step, or its tolerance where it chooses its steps."""
    name = family(point.integrator)
    tolerance = re.search(r"rtol=([^,)]+)", point.integrator)
    if name == "event_exact":
        return f"{name} {float(tolerance[1]) if tolerance else 1e-9:.0e}"
    return f"{name} {1e3 * point.dt:g} ms"


def family(integrator: str) -> str:
    """The name of an integrator out of its code."""
    name = re.split(r"\W", integrator, maxsplit=1)[0]
    return {
        "EventExact": "event_exact",
        "RK4Split": "rk4_split",
        "RK4": "rk4",
        "SemiImplicitEuler": "semi_implicit",
        "Euler": "euler",
    }[name]
