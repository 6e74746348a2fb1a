"""Measured rows as points of cost and error, and their names."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from stickslip.dynamics.biped.recommendation import QUANTILES

COSTS = {1: ("cost_1", "wall_1"), 4096: ("cost_4096",)}
"""Environments stepped together, and the columns of which the least is their cost.

One environment keeps one thread busy. Processor time also counts threads of XLA that wait in a
loop for work, up to twice as much; wall time counts what others took. Neither is less than the
work."""
NAMES = ("fidelity", "integrator", "dt", "dtype")
"""What makes a setting, as code."""
PROMISED = str(0.95)
"""The quantile that `recommend` goes by."""
UNBOUNDED = float("inf")


class Promise(NamedTuple):
    """One setting on one kind of floor and of robots: bounds of its errors, and its cost."""

    fidelity: str
    integrator: str
    dt: float
    dtype: str
    bounds: dict[str, tuple[float, float, float]]
    """By quantile: of the worse of both [rad/s], of crank angle [rad/s] and slide [m/s]."""
    otherwise: float
    other_switches: float
    cost: float

    @property
    def setting(self) -> tuple[str, str, float, str]:
        """Without what was measured."""
        return self[:4]

    @property
    def error(self) -> float:
        """What is promised [rad/s]."""
        return self.bounds[PROMISED][0]

    @property
    def typical(self) -> float:
        """What half of the walks keep [rad/s]."""
        return self.bounds["0.5"][0]


def cost_of(row: dict[str, Any], batch: int) -> float:
    """Seconds for each simulated second and environment, of a row that has them."""
    return min(row[column] for column in COSTS[batch])


def costs_of(content: dict[str, Any], scene: str, batch: int) -> dict[tuple[Any, ...], float]:
    """The cost of every setting on the walk of this scene."""
    return {
        tuple(row[name] for name in NAMES): cost_of(row, batch)
        for row in content["costs"]
        if row["scene"] == scene and all(column in row for column in COSTS[batch])
    }


def promises_of(content: dict[str, Any], scene: str, robots: str, batch: int) -> list[Promise]:
    """Every setting measured on the population whose cost is known, the cheapest first."""
    costs = costs_of(content, scene, batch)
    found = []
    for row in content["population"]:
        names = tuple(row[name] for name in NAMES)
        if (row["scene"], row["robots"]) != (scene, robots) or names not in costs:
            continue
        bounds = {
            str(q): tuple(UNBOUNDED if v is None else v for v in row["bounds"][str(q)])
            for q in QUANTILES
        }
        shares = row["ends_otherwise"], row["other_switches"]
        found.append(Promise(*names, bounds, *shares, costs[names]))  # type: ignore[arg-type]
    return sorted(found, key=lambda promise: promise.cost)


def short(point: Promise) -> str:
    """A label for a picture or a table: table 32x7, rk4_split, 5 ms, float32."""
    return f"{fidelity_name(point.fidelity)}, {integrator_name(point)}, {point.dtype}"


def fidelity_name(fidelity: str) -> str:
    """Out of its code: Table(pieces=32, degree=7) is table 32x7."""
    name, numbers = fidelity.split("(")[0].lower(), re.findall(r"=([^,)]+)", fidelity)
    return " ".join([name, "x".join(numbers)]) if numbers else name


def integrator_name(point: Promise) -> str:
    """With its step, or its tolerance where it chooses its steps."""
    name = family(point.integrator)
    tolerance = re.search(r"rtol=([^,)]+)", point.integrator)
    if name == "event_exact":
        return f"{name} {float(tolerance[1]) if tolerance else 1e-9:.0e}"
    return f"{name} {1e3 * point.dt:g} ms"


def family(integrator: str) -> str:
    """The name of an integrator out of its code."""
    name = re.split(r"\W", integrator, maxsplit=1)[0]
    return {"EventExact": "event_exact", "RK4Split": "rk4_split"}[name]
