"""The best that is known of every instance, with where it comes from."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.dynamics.numeric import read_only
from stickslip.records.files import write_whole
from stickslip.records.table import json_text

HERE = Path(__file__).parent
VALUES, POINTS = "known.json", "best.npz"
FORMAT = "stickslip known optima"


@dataclass(frozen=True)
class Known:
    """Known solution of an instance. value: of the best feasible point, whose free numbers are x;
    NaN with several goals. how: what found it. bound: what no feasible point is below, and why;
    None. digest: of the instance that this is about. front: with several goals, unbeaten values
    [points, k]. cost: microseconds of an evaluation, by kind of call."""

    value: float
    how: str
    bound: float | None
    bound_how: str
    digest: str
    cost: dict[str, float]
    x: np.ndarray | None = None
    front: np.ndarray | None = None


def known_of(name: str) -> Known | None:
    """Recorded solution of an instance; None where there is none."""
    entry = _entries().get(name)
    if entry is None:
        return None
    points = _points()
    x, front = points.get(name), points.get(f"{name} front")
    value = np.nan if entry["value"] is None else entry["value"]
    rest = {key: given for key, given in entry.items() if key not in ("value", "cost")}
    return Known(value, **rest, cost=dict(entry["cost"]), x=x, front=front)


def keep(name: str, known: Known, here: Path = HERE) -> None:
    """Write what is known of an instance beside the others, whole."""
    entries, points = dict(_entries(here)), dict(_points(here))
    entry = {one: getattr(known, one) for one in ("how", "bound", "bound_how", "digest", "cost")}
    value = None if np.isnan(known.value) else known.value
    entries[name] = {"value": value, **entry}
    for key, array in ((name, known.x), (f"{name} front", known.front)):
        points.pop(key, None)
        if array is not None:
            points[key] = array
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **dict(sorted(points.items())))
    write_whole(here / POINTS, stream.getvalue())
    write_whole(here / VALUES, json_text({"format": FORMAT, "instances": entries}))
    _entries.cache_clear()
    _points.cache_clear()


@cache
def _entries(here: Path = HERE) -> dict[str, dict[str, Any]]:
    file = here / VALUES
    return json.loads(file.read_text("utf-8"))["instances"] if file.is_file() else {}


@cache
def _points(here: Path = HERE) -> dict[str, np.ndarray]:
    file = here / POINTS
    if not file.is_file():
        return {}
    with np.load(file, allow_pickle=False) as content:
        return {name: read_only(content[name]) for name in content.files}
