"""Which of a sweep's episodes are worth looking at, found in what it has written."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.sweeps.files.directory import chunk_path
from stickslip.agents.sweeps.files.parquet import read_chunk

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from stickslip.agents.sweeps.plan import Chunk, Plan
    from stickslip.agents.sweeps.reading import SweepArrays

MOST_CHOSEN = 4
"""Of a sweep: each may need a program of its own."""
LEAST, GREATEST, MEDIAN, FAILED = "least return", "greatest return", "median return", "failed"


class Chosen(NamedTuple):
    """An episode and why it was chosen. case, point: as in the plan. recorded: its return as it was
    written, None where only its point's summary was."""

    why: str
    case: int
    point: int
    seed: int
    recorded: float | None

    @property
    def episode(self) -> tuple[int, int, int]:
        """Which one it is."""
        return self.case, self.point, self.seed


class _Rows(NamedTuple):
    """Rows of one case, every entry [rows]. returns: of an episode, or the mean of a point. failed:
    whether the episode, or all of the point, did."""

    point: np.ndarray
    seed: np.ndarray
    returns: np.ndarray
    failed: np.ndarray
    recorded: bool

    def at(self, why: str, case: int, row: int) -> Chosen:
        """One of them."""
        told = float(self.returns[row]) if self.recorded else None
        return Chosen(why, case, int(self.point[row]), int(self.seed[row]), told)


def chosen_of(path: Path, plan: Plan, found: SweepArrays) -> list[Chosen]:
    """The episodes of least, greatest and median return of each task, and one that failed while it
    earned the most; task after task until there are enough, each once with all that it is.

    The median is that of the point with the median mean return. Of a sweep that wrote summaries the
    points are ranked by their means, and the episode is that of seed 0. found: its summaries.
    """
    tasks = list(dict.fromkeys(case.task for case in plan.cases))
    each = [_of_task(path, plan, found, task) for task in tasks]
    kept: dict[tuple[int, int, int], Chosen] = {}
    for one in (group[i] for i in range(MOST_CHOSEN) for group in each if i < len(group)):
        if one.episode in kept:
            before = kept[one.episode]
            kept[one.episode] = before._replace(why=f"{before.why}, {one.why}")
        elif len(kept) < MOST_CHOSEN:
            kept[one.episode] = one
    return list(kept.values())


def _of_task(path: Path, plan: Plan, found: SweepArrays, task: str) -> list[Chosen]:
    best: dict[str, tuple[float, Chosen]] = {}

    def offer(why: str, case: int, rows: _Rows, merit: np.ndarray) -> None:
        if np.isfinite(merit).any():
            row = int(np.nanargmax(np.where(np.isfinite(merit), merit, np.nan)))
            if why not in best or merit[row] > best[why][0]:
                best[why] = float(merit[row]), rows.at(why, case, row)

    for case, rows in _written(path, plan, task):
        offer(LEAST, case, rows, -rows.returns)
        offer(GREATEST, case, rows, rows.returns)
        offer(FAILED, case, rows, np.where(rows.failed, rows.returns, np.nan))
    if LEAST not in best:
        return []
    picked = {why: one for why, (_, one) in best.items()}
    picked[MEDIAN] = _median(path, plan, found, task)
    return [picked[why] for why in (LEAST, GREATEST, MEDIAN, FAILED) if why in picked]


def _written(path: Path, plan: Plan, task: str) -> Iterator[tuple[int, _Rows]]:
    """A task's chunks, each with its case."""
    for chunk in plan.chunks:
        if plan.cases[chunk.case].task == task:
            yield chunk.case, _rows(path, plan, chunk)


def _rows(path: Path, plan: Plan, chunk: Chunk) -> _Rows:
    if not plan.summaries:
        names = ["point", "seed", "reward", "fell"]
        table = read_chunk(chunk_path(path, chunk.number), names)
        return _Rows(*(np.asarray(table[name]) for name in names), recorded=True)
    names = ["point", "reward_mean", "falls", "episodes"]
    table = read_chunk(chunk_path(path, chunk.number), names)
    point, mean, falls, count = (np.asarray(table[name]) for name in names)
    return _Rows(point, np.zeros_like(point), mean, falls == count, recorded=False)


def _median(path: Path, plan: Plan, found: SweepArrays, task: str) -> Chosen:
    """The median episode of the median point of all the task's policies."""
    at = found.coordinates["task"].tolist().index(task)
    policies = found.coordinates["policy"].tolist()
    means = found["reward_mean"][at].reshape(len(policies), -1)
    order = np.argsort(means, axis=None, kind="stable")
    whole = int(np.isfinite(means).sum())
    which, point = divmod(int(order[(whole - 1) // 2]), means.shape[1])
    cases = [(one.task, one.policy) for one in plan.cases]
    case = cases.index((task, policies[which]))
    chunk = next(c for c in plan.chunks if c.case == case and c.first <= point < c.last)
    rows = _rows(path, plan, chunk)
    own = np.flatnonzero(rows.point == point)
    order = own[np.argsort(rows.returns[own], kind="stable")]
    return rows.at(MEDIAN, case, int(order[(len(own) - 1) // 2]))
