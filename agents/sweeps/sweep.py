"""Sweeps: policies on tasks at every point of a grid, into a directory."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, TypedDict, Unpack

from stickslip.agents.evaluation.rollout import require_named
from stickslip.agents.sweeps.axes import Design
from stickslip.agents.sweeps.cases import cases_on
from stickslip.agents.sweeps.data import cell_table
from stickslip.agents.sweeps.engine import run_dask, run_threads, threads_of
from stickslip.agents.sweeps.plan import Plan
from stickslip.agents.sweeps.play import Player
from stickslip.agents.sweeps.store import missing_cells, open_store, write_cell
from stickslip.agents.training.directory import only_writer
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import numpy as np

    from stickslip.agents.sweeps.axes import AxisLike
    from stickslip.agents.sweeps.cases import Policies, Tasks


@dataclass(frozen=True)
class SweepResult:
    """What a call of `sweep` did.

    episodes, cells: of the whole sweep; played: cells that this call played. programs: compiled in
    this process, None where workers did.
    """

    path: Path
    episodes: int
    cells: int
    played: int
    programs: int | None


class How(TypedDict, total=False):
    """How a sweep is played, see `sweep`."""

    cell: int | None
    tile: int | None
    cores: int | None
    workers: int | None
    scheduler: str | None
    resume: bool
    progress: bool
    stop: Callable[[], bool]


def sweep(
    task: Tasks,
    policies: Policies,
    axes: Mapping[str, AxisLike],
    episodes: int = 32,
    out: str | Path = "sweep",
    *,
    samples: int | None = None,
    design_seed: int = 0,
    **how: Unpack[How],
) -> SweepResult:
    """Play episodes of every policy on every task at every point of the axes, and write them.

    task: a named task, (env, params), or several: a list of names or a dict by labels. policies:
    names (baselines, files), or controllers by name. axes: by names of parameters, dotted or short
    (see docs/sweeps.md), each an `Axis`, its text ("0.02:0.3:64", "1:100:5:log", "0.1,0.2",
    "0.02:0.3:sobol") or values. samples: points of the random axes, from design_seed.

    Each point gets the episodes of seeds 0, 1, ..., as `evaluate` plays them: the same draws at
    every point. No result depends on cells, cores, workers or their order.

    out: a directory of its own, which `read_sweep` reads. cell: episodes of a file, and tile: of
    one call of the vmapped program, by default what suits memory and cores. cores: cells at once,
    by default one for each core or device. workers: processes of this machine instead; scheduler:
    the address of a Dask scheduler.

    resume: continue the sweep in `out`. progress: show a bar. stop: polled; StoppedError where it
    says so, and the sweep can be resumed.

    ValueError for unknown axes, values out of a task's range, policies that do not fit, a directory
    of something else. MemoryError where a tile does not fit.
    """
    require_named("axes", axes, '{"mu": "0.02:0.3:64"} or such')
    machine, given = cases_on(task, policies)
    machine.swept().require_no_structure(axes)
    plan = Plan.of(machine, given, Design.of(dict(axes), samples, design_seed), episodes)
    return run_plan(plan, Path(out), **how)


def run_plan(
    plan: Plan,
    path: Path,
    *,
    cell: int | None = None,
    tile: int | None = None,
    cores: int | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    resume: bool = False,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> SweepResult:
    """`sweep`, of a plan."""
    dask = workers is not None or scheduler is not None
    if dask and cores is not None:
        raise ValueError("cores beside workers or a scheduler; accepted: one of them")
    threads = threads_of(cores if workers is None else workers)
    plan = plan.cut(cell, threads, tile)
    with only_writer(path, "sweeping"):
        plan = _opened(plan, path, cell, resume)
        todo = missing_cells(path, "sweep", plan.digest, len(plan.cells), plan.size)
        left, lock = sum(map(plan.size, todo)), Lock()
        with Bar("sweep", plan.total, "episode", progress, at=plan.total - left, large=True) as bar:

            def keep(number: int, columns: dict[str, np.ndarray]) -> None:
                write_cell(path, number, plan.digest, cell_table(plan, number, columns))
                with lock:
                    bar.advance(plan.size(number))

            if dask:
                content = pickle.dumps(partial(_worker, plan))
                run_dask(content, keep, todo, stop=stop, workers=workers, scheduler=scheduler)
                programs = None
            else:
                player = Player(plan)
                run_threads(player.play, keep, todo, threads=threads, stop=stop)
                programs = player.programs
    return SweepResult(path, plan.total, len(plan.cells), len(todo), programs)


def _worker(plan: Plan) -> Callable[[int], dict[str, np.ndarray]]:
    """What plays a plan's cells in a worker; its programs are kept for the next cell."""
    return Player(plan).play


def _opened(plan: Plan, path: Path, cell: int | None, resume: bool) -> Plan:
    """Open the directory; the plan, cut as it was when the sweep was begun."""
    head = open_store(
        path,
        "sweep",
        definition=plan.definition,
        digest=plan.digest,
        cells=len(plan.cells),
        about=plan.about(),
        resume=resume,
    )
    layout = plan.layout_from(head, path)
    if cell is not None and plan.layout.cell_points != layout.cell_points:
        size = layout.cell_points * plan.episodes
        raise ValueError(
            f"cell = {cell}, but {path} was begun with cells of {size}; accepted: to resume "
            "without it"
        )
    return replace(plan, layout=layout)
