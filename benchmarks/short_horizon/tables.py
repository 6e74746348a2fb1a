"""What was measured of gradients through the simulator, as tables for a page."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from benchmarks.report import markdown, where
from benchmarks.short_horizon.slopes import GROUNDS, HORIZONS
from benchmarks.training.tables import scale_of
from stickslip.agents.evaluation.statistics import mean_interval

NAMES = {"ppo": "PPO", "shac": "SHAC", "sac": "SAC (SB3)"}
SHOWN = (8, 32, 96)
"""Horizons in the table."""


class Compared(NamedTuple):
    """Of one horizon: the cosine of the angle between the first-order estimate and the differences,
    how many times as long it is, and the spread of single walks in lengths of the differences."""

    cosine: float
    length: float
    spread: float


def compared(slopes: dict[str, Any], name: str, which: str) -> list[Compared]:
    """A floor's first-order estimate beside the differences on the floor it is to be right for."""
    first = slopes[name][which]["first"]
    truth = slopes[GROUNDS[name].truth][which]["differences"]
    rows = []
    for own, other, spread in zip(first["mean"], truth["mean"], first["spread"], strict=True):
        one, two = np.asarray(own), np.asarray(other)
        long, right = float(np.linalg.norm(one)), float(np.linalg.norm(two))
        rows.append(Compared(float(one @ two) / (long * right), long / right, spread / right))
    return rows


def slopes_body(content: dict[str, Any]) -> str:
    """A row a floor and horizon."""
    found, rows = content["slopes"], []
    for name in found:
        every, upright = (compared(found, name, which) for which in ("all", "upright"))
        for horizon in SHOWN:
            at = HORIZONS.index(horizon)
            rows.append(
                {
                    "floor": name,
                    "steps": f"{horizon}",
                    "fall": f"{1 - found[name]['share_upright'][at]:.1%}",
                    "cosine": f"{every[at].cosine:.2f}",
                    "length": f"{every[at].length:.2f}",
                    "spread": f"{every[at].spread:.2g}",
                    "cosine, no falls": f"{upright[at].cosine:.2f}",
                    "length, no falls": f"{upright[at].length:.2f}",
                    "spread, no falls": f"{upright[at].spread:.2g}",
                }
            )
    return f"{markdown(rows)}\n\nMeasured on {where(content, 'slopes')}."


def scores(entry: dict[str, Any], name: str) -> np.ndarray:
    """[seeds, points]."""
    return np.vectorize(scale_of(name).score)(np.asarray(entry["returns"], float))


def curves_body(content: dict[str, Any]) -> str:
    """A row a task and algorithm."""
    rows = []
    for name, entries in content.get("curves", {}).items():
        for algorithm, entry in entries.items():
            found = scores(entry, name)
            middle, end = (
                mean_interval(column) for column in found[:, [found.shape[1] // 2, -1]].T
            )
            rows.append(
                {
                    "task": f"`{name}`",
                    "algorithm": NAMES[algorithm],
                    "seeds": f"{len(found)}",
                    "seconds": f"{entry['limit']:g}",
                    "processor [s]": f"{np.mean([row[-1] for row in entry['processor']]):.0f}",
                    "steps": f"{np.mean([row[-1] for row in entry['steps']]) / 1e6:.2g} M",
                    "to compile [processor s]": f"{entry['compile_processor_seconds']:.0f}",
                    "score, a little past half": f"{middle.value:.2f}",
                    "score at the end": f"{end.value:.2f} ± {end.high - end.value:.2f}",
                }
            )
    return f"{markdown(rows)}\n\nMeasured on {where(content, 'curves')}."
