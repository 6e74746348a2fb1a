"""Sweeps: policies on tasks at every point of a grid, into a directory."""

from __future__ import annotations

import pickle
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax

from stickslip.agents.sweeps.cases import cases_on
from stickslip.agents.sweeps.cells import (
    missing_cells,
    open_store,
    read_head,
    run_cells,
    write_cell,
)
from stickslip.agents.sweeps.data import cell_table
from stickslip.agents.sweeps.plan import Plan, Player, axes_of
from stickslip.agents.training.directory import only_writer
from stickslip.envs.collecting import cores_here
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from concurrent.futures import Executor

    import numpy as np

    from stickslip.agents.sweeps.cases import Policies, Tasks
    from stickslip.agents.sweeps.plan import AxisLike


@dataclass(frozen=True)
class SweepResult:
    """Result of `sweep`. episodes, cells: of the whole sweep; played: cells of this call."""

    path: Path
    episodes: int
    cells: int
    played: int


def sweep(
    task: Tasks,
    policies: Policies,
    axes: Mapping[str, AxisLike],
    episodes: int = 32,
    out: str | Path = "sweep",
    **how: Any,
) -> SweepResult:
    """Play episodes of every policy on every task at every point of the axes, and write them.

    task: a named task, (env, params), or several: a list of names or a dict by labels. policies:
    names (baselines, files), or controllers by name. axes: by names of parameters, dotted or short
    (see docs/sweeps.md), each a text ("0.02:0.3:64", "1:100:5:log", "0.1,0.2") or values.

    Each point gets the episodes of seeds 0, 1, ..., as `evaluate` plays them: the same draws at
    every point. No result depends on cores, devices, workers or their order.

    out: a directory of its own, which `read_sweep` reads. cell: episodes of a file and of one call
    of the vmapped program (default: what suits memory). executor: one of concurrent.futures' kind
    that computes the cells, in other processes or on other machines (default: a thread for each
    core or device).

    resume: continue the sweep in `out`. progress: show a bar. stop: polled; StoppedError where it
    returns True, and the sweep can be resumed.

    ValueError for unknown axes, values out of a task's range, policies that do not fit, a directory
    of something else.
    """
    grid = axes_of(axes)
    machine, cases = cases_on(task, policies, grid)
    return run_plan(Plan.of(machine, cases, grid, episodes), Path(out), **how)


def run_plan(
    plan: Plan,
    path: Path,
    *,
    cell: int | None = None,
    executor: Executor | None = None,
    resume: bool = False,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> SweepResult:
    """`sweep`, of a plan: play the cells that are not in the directory."""
    count = jax.local_device_count()
    threads = count if count > 1 or jax.default_backend() != "cpu" else cores_here()
    plan = plan.cut(cell, threads)
    with only_writer(path, "sweeping"), ExitStack() as stack:
        plan = _opened(plan, path, cell, resume)
        head, todo = read_head(path, "sweep"), missing_cells(path, "sweep")
        left = sum(plan.at(one).last - plan.at(one).first for one in todo)
        bar = Bar("sweep", plan.total, "episode", progress, at=plan.total - left, large=True)
        stack.enter_context(bar)

        def keep(number: int, columns: dict[str, np.ndarray]) -> None:
            write_cell(path, number, head, cell_table(plan, number, columns))
            bar.advance(len(columns["fell"]))

        pool = executor or stack.enter_context(ThreadPoolExecutor(threads))
        here = isinstance(pool, ThreadPoolExecutor)
        play = Player(plan) if here else partial(_play, pickle.dumps(partial(Player, plan)))
        run_cells(partial(pool.submit, play), keep, todo, stop)
    return SweepResult(path, plan.total, plan.cells, len(todo))


def _play(content: bytes, number: int) -> dict[str, np.ndarray]:
    """Compute a cell in a worker."""
    return _loaded(content)(number)


@lru_cache(maxsize=4)
def _loaded(content: bytes) -> Player:
    """A worker's player, with the programs that it compiled."""
    return pickle.loads(content)()


def _opened(plan: Plan, path: Path, cell: int | None, resume: bool) -> Plan:
    """Open the directory; the plan with the cells that the sweep was begun with."""
    random = list(dict.fromkeys(one.task for one in plan.cases if one.random))
    about = {"cell": plan.cell, "units": plan.units, "random": random}
    head = open_store(
        path, "sweep", definition=plan.definition, cells=plan.cells, about=about, resume=resume
    )
    begun, size = replace(plan, cell=head.get("cell")), head.get("cell")
    if not isinstance(size, int) or not 0 < size <= plan.of_case or begun.cells != head["cells"]:
        raise ValueError(f"{path / 'sweep.json'}: cell = {size}; accepted: the file as written")
    if cell is not None and plan.cell != size:
        raise ValueError(
            f"cell = {cell}, but {path} was begun with cells of {size}; accepted: to resume "
            "without it"
        )
    return begun
