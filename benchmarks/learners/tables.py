"""What was measured of learners, as a table."""

from __future__ import annotations

import statistics
from typing import Any

from benchmarks.report import markdown, where
from benchmarks.training.tables import GOAL


def body(content: dict[str, Any]) -> str:
    """A row a task and learner, the fastest to the goal first."""
    rows = []
    for task, learners in content.get("tasks", {}).items():
        made = [(name, list(entries.values())) for name, entries in learners.items()]
        made.sort(key=lambda one: (-_reached(one[1]), _seconds(one[1])))
        rows += [{"task": f"`{task}`", "learner": name} | row(entries) for name, entries in made]
    return f"{markdown(rows)}\n\nMeasured on {where(content)}."


def row(entries: list[dict[str, Any]]) -> dict[str, str]:
    """Medians over the seeds that reached the goal; where none did, of how far all came."""
    reached = [one for one in entries if one["reached"] is not None]
    ends = [_end(one) for one in reached or entries]
    steps, wall, processor, _ = (statistics.median(column) for column in zip(*ends, strict=True))
    best = statistics.median(max(point[3] for point in one["points"]) for one in entries)
    compiled = statistics.median(before_learning(one) for one in reached or entries)
    told = all(len(one["points"]) > 1 for one in entries)  # else nothing tells compiling apart
    return {
        "seeds": f"{len(entries)}",
        f"reach {GOAL}": f"{len(reached)} of {len(entries)}",
        "steps": f"{steps / 1e6:.2g} M",
        "wall [s]": f"{wall:.1f}",
        "processor [s]": f"{processor:.1f}",
        "of that compiling": f"{compiled:.1f}" if told else "",
        "a million steps [s]": f"{(processor - compiled) / steps * 1e6:.3g}" if told else "",
        "best score": f"{best:.2f}",
    }


def before_learning(entry: dict[str, Any]) -> float:
    """Processor seconds of the first stretch beyond what its steps take later: compiling."""
    first, *rest = entry["points"]
    if not rest:
        return 0.0
    pairs = zip(entry["points"], rest, strict=False)
    rate = statistics.median((b[2] - a[2]) / (b[0] - a[0]) for a, b in pairs)
    return max(0.0, first[2] - first[0] * rate)


def _reached(entries: list[dict[str, Any]]) -> int:
    return sum(one["reached"] is not None for one in entries)


def _seconds(entries: list[dict[str, Any]]) -> float:
    reached = [one for one in entries if one["reached"] is not None]
    return statistics.median(_end(one)[2] for one in reached or entries)


def _end(entry: dict[str, Any]) -> list[float]:
    """Where it reached the goal, else the last point."""
    return entry["points"][-1 if entry["reached"] is None else entry["reached"]]
