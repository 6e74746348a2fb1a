"""What can be promised of a setting: quantiles of its errors on the population, with confidence."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from benchmarks.quantiles import rank
from benchmarks.tradeoff.cases import code, promised
from benchmarks.tradeoff.marching import SHORTEST, errors, paths, references, sensitivities, walked
from benchmarks.tradeoff.population import FLOORS, ROBOTS, Walks, both
from stickslip.dynamics.biped.trade.promises import CONFIDENCE, QUANTILES
from stickslip.dynamics.biped.trade.walk_check import SENSITIVE

if TYPE_CHECKING:
    from collections.abc import Callable

    from stickslip.dynamics.biped.trade.setting import Setting
    from stickslip.dynamics.biped.trade.walk_check import Path

COUNT = 512
"""Walks of each kind of robot on each kind of floor."""
DERIVED = 64
"""So many of them are differentiated, too."""


def bound(values: np.ndarray, quantile: float, confidence: float = CONFIDENCE) -> float:
    """The upper confidence bound of the quantile; infinite where there are too few values."""
    k = rank(len(values), quantile, confidence)
    return float(np.sort(values)[k - 1]) if k <= len(values) else float("inf")


def population(
    quick: bool, say: Callable[[str], None], keep: Callable[[dict[str, Any]], None]
) -> dict[str, Any]:
    """Every setting on every walk: what the samples are like, and a row for each setting."""
    count, derived = (48, 8) if quick else (COUNT, DERIVED)
    found: dict[str, Any] = {"samples": [], "rows": []}
    begun = time.perf_counter()
    for floor in FLOORS:
        with jax.enable_x64(True):
            walks = both(floor, range(count))
        truth = references(walks)
        groups = _groups(truth, count)
        grown = {
            robots: sensitivities(_picked(walks, own[:derived])) for robots, own in groups.items()
        }
        for robots, own in groups.items():
            found["samples"].append(_sample(floor, robots, count, own, truth, grown[robots]))
            say(f"[{time.perf_counter() - begun:.0f} s] {found['samples'][-1]}")
        for setting in promised(quick):
            path = paths(walks, setting)
            off = errors(walks, path, truth)
            new = [_row(floor, r, setting, off, path, truth, own) for r, own in groups.items()]
            found["rows"] += new
            keep(found)
            shown = ", ".join(_shown(row["bounds"]["0.95"][0]) for row in new)
            say(f"[{time.perf_counter() - begun:.0f} s] {floor} {setting}: {shown}")
    return found


def _groups(truth: Path, count: int) -> dict[str, np.ndarray]:
    """The walks of each kind of robot that last long enough."""
    long = walked(truth) >= SHORTEST
    return {
        robots: np.flatnonzero(long[i * count : (i + 1) * count]) + i * count
        for i, robots in enumerate(ROBOTS)
    }


def _picked(walks: Walks, places: np.ndarray) -> Walks:
    return jax.tree.map(lambda leaf: np.asarray(leaf)[places], walks)


def _sample(floor: str, robots: str, count: int, own, truth: Path, grown) -> dict[str, Any]:
    status = truth.status[own, -1]
    return {
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


def _row(floor: str, robots: str, setting: Setting, off, path: Path, truth: Path, own):
    ends, wanted = path.status[own, -1], truth.status[own, -1]
    over, ended = ends > 1, wanted > 1
    return {
        "scene": floor,
        "robots": robots,
        "fidelity": code(setting.fidelity),
        "integrator": code(setting.integrator),
        "dtype": setting.dtype,
        "dt": setting.dt,
        "bounds": {str(q): [_number(bound(values[own], q)) for values in off] for q in QUANTILES},
        "median": float(np.median(off[0][own])),
        "worst": _number(float(np.max(off[0][own]))),
        "ends_otherwise": float(np.mean((over != ended) | (over & (ends != wanted)))),
        "other_switches": float(np.mean(path.kinds[own, -1] != truth.kinds[own, -1])),
    }


def _number(value: float) -> float | None:
    """None for an error without bound, which JSON has no number for."""
    return float(value) if np.isfinite(value) else None


def _shown(value: float | None) -> str:
    return "no bound" if value is None else f"{value:.1e}"
