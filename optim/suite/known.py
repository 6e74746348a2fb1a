"""The best that is known of every instance, with where it comes from."""

from __future__ import annotations

import io
import json
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.records.files import write_whole
from stickslip.records.table import json_text

if TYPE_CHECKING:
    from stickslip.optim.suite.instance import Instance

HERE = Path(__file__).parent
VALUES, POINTS = "known.json", "best.npz"
FORMAT = "stickslip known optima"
SAME = 1e-6
"""How far a value may be off the recorded one, in parts of it: roundings of another machine."""


@dataclass(frozen=True)
class Known:
    """What is known of an instance. value: of the best feasible point, whose free numbers are x;
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

    def with_cost(self, cost: dict[str, float]) -> Known:
        """The same with another cost."""
        return replace(self, cost=cost)


def known_of(name: str) -> Known | None:
    """What is recorded of an instance; None where nothing is."""
    entry = _entries().get(name)
    if entry is None:
        return None
    points = _points()
    x, front = points.get(name), points.get(f"{name} front")
    value = np.nan if entry["value"] is None else entry["value"]
    rest = {key: given for key, given in entry.items() if key != "value"}
    return Known(value, **rest, x=x, front=front)


def verified(instance: Instance) -> str:
    """ "as recorded", with what is, or what differs: the instance, its value, its feasibility."""
    known = instance.known
    if known is None:
        return "nothing is recorded"
    if instance.digest() != known.digest:
        return "another instance than the recorded one: its numbers differ"
    if known.x is None:
        return "no point is recorded"
    wanted: np.ndarray | float
    if known.front is not None:
        found = [instance.value(one) for one in known.x]
        values, feasible = np.array([at[0] for at in found]), all(at[1] for at in found)
        wanted = known.front
    else:
        values, feasible = instance.value(known.x)
        wanted = known.value
    if not feasible:
        return "the recorded point is not feasible"
    if not np.allclose(values, wanted, rtol=SAME, atol=SAME):
        return f"{values} at the recorded point, recorded {wanted}"
    bound = known.bound
    return "as recorded" + ("" if bound is None else f", {bound:.8g} at least: {known.bound_how}")


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
        return {name: content[name] for name in content.files}
