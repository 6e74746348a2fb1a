"""What was measured of training, as tables for pages and as entries of the ladder's known.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.report import markdown, where
from benchmarks.tasks.measure import rounded
from stickslip.agents.evaluation.statistics import mean_interval
from stickslip.envs import TASKS, known_of
from stickslip.envs.tasks import Scale

GOAL = 0.9
"""The score whose time is looked for."""


def scale_of(name: str) -> Scale:
    """From returns to scores. ValueError where nothing is known of a task."""
    known = known_of(TASKS[name])
    if known is None:
        raise ValueError(f"nothing is known of {name}; accepted: a task that was measured")
    return known.scale


def scores(entry: dict[str, Any], name: str) -> np.ndarray:
    """[seeds, points] of a trainer's entry."""
    scale = scale_of(name)
    return np.vectorize(scale.score)(np.asarray(entry["returns"], float))


def reached(entry: dict[str, Any], name: str) -> list[int]:
    """For each seed that scored GOAL the first point at which it did."""
    good = scores(entry, name) >= GOAL
    return [int(np.argmax(row)) for row in good if row.any()]


def body(content: dict[str, Any]) -> str:
    """Steps, time and scores of the JAX trainer on each task."""
    tasks = content.get("tasks", {})
    rows = [
        {"task": f"`{name}`"} | _row(tasks[name]["jax"], name)
        for name in TASKS
        if "jax" in tasks.get(name, {})
    ]
    return f"{markdown(rows)}\n\nMeasured on {where(content)}."


def _row(entry: dict[str, Any], name: str) -> dict[str, str]:
    found, first = scores(entry, name), reached(entry, name)
    row = {
        "seeds": f"{len(found)}",
        "steps": f"{entry['steps'][-1] / 1e6:.2g} M",
        "processor [s]": f"{entry['processor_seconds'][-1]:.0f}",
        "score at the end": _spread(found[:, -1]),
        f"reach {GOAL}": f"{len(first)} of {len(found)}",
    }
    point = None if len(first) <= len(found) / 2 else int(np.median(first))
    row["after, steps"] = "" if point is None else f"{entry['steps'][point] / 1e6:.2g} M"
    row["after, processor [s]"] = (
        "" if point is None else f"{entry['processor_seconds'][point]:.1f}"
    )
    return row


def _spread(values: np.ndarray) -> str:
    mean = mean_interval(values)
    return f"{mean.value:.2f} ± {mean.high - mean.value:.2f}"


def learned(entry: dict[str, Any], name: str) -> dict[str, Any]:
    """The entry "learned" of known.json: what the last policies earn."""
    how = (
        "PPO in JAX, the defaults and training episodes of `stickslip train`, "
        f"{entry['steps'][-1]:,} steps (docs/training.md)"
    )
    return {"how": how, "returns": [rounded(row[-1]) for row in entry["returns"]]}
