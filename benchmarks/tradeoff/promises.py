"""What can be promised of a setting: quantiles of its errors on the population, with confidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from functools import lru_cache
from typing import Any

import jax
import numpy as np

from benchmarks.points import rank
from benchmarks.tradeoff.marching import SHORTEST, errors, paths, references, sensitivities, walked
from benchmarks.tradeoff.population import FLOORS, ROBOTS, Walks, both
from stickslip.dynamics.biped import EventExact, RK4Split, Table
from stickslip.dynamics.biped.recommendation import CONFIDENCE, QUANTILES
from stickslip.dynamics.biped.setting import Setting
from stickslip.dynamics.biped.walk_check import SENSITIVE, Path

COUNT = 512
"""Walks of each kind of robot on each kind of floor."""
DERIVED = 64
"""So many of them are differentiated, too."""
PERIOD = 0.02


def settings(quick: bool) -> list[Setting]:
    """The settings that are measured; steps of the default robot."""
    table, fine = Table(), Table(64, 9)

    def split(fidelity: Table, dtype: str, *counts: int) -> list[Setting]:
        return [Setting(fidelity, RK4Split(), PERIOD / n, dtype) for n in counts]

    if quick:
        return split(table, "float32", 1, 4)
    return [
        *split(Table(8, 4), "float32", 1, 2),
        *split(table, "float32", 1, 2, 4, 8),
        *split(table, "float64", 1, 2, 4, 8, 16),
        *split(fine, "float64", 16, 64),
        Setting(table, EventExact(rtol=1e-4, atol=1e-7), PERIOD, "float64"),
        Setting(table, EventExact(rtol=1e-7, atol=1e-10), PERIOD, "float64"),
        Setting(fine, EventExact(rtol=1e-10, atol=1e-13), PERIOD, "float64"),
    ]


def names_of(setting: Setting) -> dict[str, Any]:
    """A setting's fidelity and integrator as code, its dtype and step."""
    return {
        "fidelity": code(setting.fidelity),
        "integrator": code(setting.integrator),
        "dtype": setting.dtype,
        "dt": setting.dt,
    }


def code(spec: Any) -> str:
    """The expression that makes a fidelity or an integrator; defaults left out."""
    given = [
        f"{field.name}={getattr(spec, field.name)!r}"
        for field in fields(spec)
        if getattr(spec, field.name) != field.default or isinstance(spec, Table)
    ]
    return f"{type(spec).__name__}({', '.join(given)})"


def bound(values: np.ndarray, quantile: float, confidence: float = CONFIDENCE) -> float:
    """The upper confidence bound of the quantile; infinite where there are too few values."""
    k = rank(len(values), quantile, confidence)
    return float(np.sort(values)[k - 1]) if k <= len(values) else float("inf")


@lru_cache(maxsize=1)
def drawn(floor: str, count: int) -> tuple[Walks, Path, dict[str, np.ndarray]]:
    """Walks, references, and the walks of each kind of robot that last long enough."""
    with jax.enable_x64(True):
        walks = both(floor, range(count))
    truth = references(walks)
    long = walked(truth) >= SHORTEST
    groups = {
        robots: np.flatnonzero(long[i * count : (i + 1) * count]) + i * count
        for i, robots in enumerate(ROBOTS)
    }
    return walks, truth, groups


def samples(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor and kind of robots: what the walks are like."""
    count, derived = (48, 8) if quick else (COUNT, DERIVED)
    for floor in FLOORS:
        walks, truth, groups = drawn(floor, count)
        for robots, own in groups.items():
            picked = jax.tree.map(lambda leaf, own=own: np.asarray(leaf)[own[:derived]], walks)
            grown = sensitivities(picked)
            status = truth.status[own, -1]
            yield {
                "scene": floor,
                "robots": robots,
                "seeds": [0, count - 1],
                "count": len(own),
                "too_short": count - len(own),
                "left": float(np.mean(status > 1)),
                "not_converged": float(np.mean(status == 9)),
                "switches": float(np.median(truth.kinds[own, -1])),
                "derived": len(grown),
                "sensitive": float(np.mean(~(grown <= SENSITIVE))),
                "sensitivity": [_number(v) for v in np.nanquantile(grown, [0.5, 0.95, 1.0])],
            }


def population(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each floor, setting and kind of robots."""
    for floor in FLOORS:
        walks, truth, groups = drawn(floor, 48 if quick else COUNT)
        for setting in settings(quick):
            path = paths(walks, setting)
            off = errors(walks, path, truth)
            for robots, own in groups.items():
                names = {"scene": floor, "robots": robots, **names_of(setting)}
                yield names | _quantiles(off, path, truth, own)


def _quantiles(off: np.ndarray, path: Path, truth: Path, own: np.ndarray) -> dict[str, Any]:
    ends, wanted = path.status[own, -1], truth.status[own, -1]
    over, ended = ends > 1, wanted > 1
    return {
        "bounds": {str(q): [_number(bound(values[own], q)) for values in off] for q in QUANTILES},
        "median": float(np.median(off[0][own])),
        "worst": _number(float(np.max(off[0][own]))),
        "ends_otherwise": float(np.mean((over != ended) | (over & (ends != wanted)))),
        "other_switches": float(np.mean(path.kinds[own, -1] != truth.kinds[own, -1])),
    }


def _number(value: float) -> float | None:
    """None for an error without bound, which JSON has no number for."""
    return float(value) if np.isfinite(value) else None
