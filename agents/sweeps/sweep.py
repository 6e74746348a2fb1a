"""Sweeps: policies on tasks at every point of a grid, into a directory."""

import pickle
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import jax
import numpy as np

from stickslip.agents.evaluation.players import every_option
from stickslip.agents.machine import machine_by_name
from stickslip.agents.protocol import Options
from stickslip.agents.sweeps import cells
from stickslip.agents.sweeps.data import cell_table, summary_table, sweep_arrays, write_pictures
from stickslip.agents.sweeps.plan import CellPlayer, Plan, Policies, Tasks, cases_named, cases_on
from stickslip.agents.sweeps.swept import FORMS, AxisLike, axes_of
from stickslip.agents.training.directory import only_writer
from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.collecting import cores_here
from stickslip.optim.progress import Bar
from stickslip.records.files import require_folder
from stickslip.records.signals import stoppable
from stickslip.records.table import Content, with_unit


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
    of the vmapped program (default: what suits memory). executor: of concurrent.futures' kind, in
    other processes or on other machines (default: a thread for each core or device).

    resume: continue the sweep in `out`. progress: show a bar. stop: polled; StoppedError where it
    returns True, and the sweep can be resumed.

    ValueError for unknown axes, values out of range, policies that do not fit, other directories.
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
    accepted = "None, or an Executor of concurrent.futures, as `client.get_executor()` of Dask"
    require_kind("executor", executor, (Executor, type(None)), accepted)
    count = jax.local_device_count()
    threads = count if count > 1 or jax.default_backend() != "cpu" else cores_here()
    plan = plan.cut(cell, threads)
    with only_writer(path, "sweeping"), ExitStack() as stack:
        plan = _opened(plan, path, cell, resume)
        head, todo = cells.read_head(path, "sweep"), cells.missing_cells(path, "sweep")
        left = sum(last - first for _, first, last in map(plan.at, todo))
        bar = Bar("sweep", plan.total, "episode", progress, at=plan.total - left, large=True)
        stack.enter_context(bar)

        def keep(number: int, made: Future[dict[str, np.ndarray]]) -> None:
            columns = made.result()
            cells.write_cell(path, number, head, cell_table(plan, number, columns))
            bar.advance(len(columns["fell"]))

        pool = executor or stack.enter_context(ThreadPoolExecutor(threads))
        here = isinstance(pool, ThreadPoolExecutor)
        play = CellPlayer(plan) if here else partial(_play, pickle.dumps(partial(CellPlayer, plan)))
        cells.run_cells(partial(pool.submit, play), keep, todo, stop, here)
    return SweepResult(path, plan.total, plan.cells, len(todo))


def _play(content: bytes, number: int) -> dict[str, np.ndarray]:
    """Compute a cell in a worker."""
    return _loaded(content)(number)


@lru_cache(maxsize=4)
def _loaded(content: bytes) -> CellPlayer:
    """A worker's player, with the programs that it compiled."""
    return pickle.loads(content)()


def _opened(plan: Plan, path: Path, cell: int | None, resume: bool) -> Plan:
    """Open the directory; the plan with the cells that the sweep was begun with."""
    random = list(dict.fromkeys(one.task for one in plan.cases if one.random))
    content = {"definition": plan.definition, "cells": plan.cells, "cell": plan.cell}
    content |= {"units": plan.units, "random": random}
    head = cells.open_store(path, "sweep", content, resume)
    begun, size = replace(plan, cell=head.get("cell")), head.get("cell")
    if not isinstance(size, int) or not 0 < size <= plan.of_case or begun.cells != head["cells"]:
        raise ValueError(f"{path / 'sweep.json'}: cell = {size}; accepted: the file as written")
    if cell is not None and plan.cell != size:
        given = f"cell = {cell}, but {path} was begun with cells of {size}"
        raise ValueError(f"{given}; accepted: to resume without it")
    return begun


def sweep_command(given: Options) -> Content:
    """Play the sweep, print its summary and draw it."""
    path, plan = Path(given["out"]), _planned(given)
    begun = time.monotonic()
    with stoppable(f"Stopped; go on with the same command and --resume ({path})") as stop:
        done = run_plan(plan, path, resume=given["resume"], progress=True, stop=stop)
    print(f"Played {done.played} of {done.cells} cells in {time.monotonic() - begun:.1f} s")
    slip, found = plan.machine.swept().slip, sweep_arrays(path)
    table, files = summary_table(found, slip), list[Path]()
    print("\n" + table.rounded(4).terminal())
    if not given["no_pictures"] and find_spec("matplotlib"):
        files = write_pictures(found, path, slip)
    print("Written: " + ", ".join(map(str, [path, *files])))
    return Content({"summary": table}, {"directory": str(path), "files": list(map(str, files))})


def _planned(given: Options) -> Plan:
    """Check the arguments and print the plan."""
    require_folder(given["out"])
    machine, axes = machine_by_name(given["machine"]), {}
    for text in given["axis"]:
        name, _, values = text.partition("=")
        if not name or not values or name in axes:
            accepted = f"NAME=VALUES, each name once, with values as {FORMS}"
            raise ValueError(f"--axis {shown(text)}; accepted: {accepted}")
        axes[name] = values
    options = {name: given.get(name) for name in every_option()}
    options["changes"] = given.get("changes")  # none of a machine without parts
    options["numbers"] = {}  # which an axis of one value sets
    options["scenes"] = None if given["scene"] is None else [given["scene"]]
    grid = axes_of(axes)
    cases, about = cases_named(machine, given["policy"], options, given["task"], grid)
    plan = Plan.of(machine, cases, grid, given["episodes"])
    print(about)
    for name, values in grid.items():
        sets = ", ".join(plan.cases[0].fields[name])
        span = f"{min(values):g} to {with_unit(max(values), plan.units[name], 6)}"
        print(f"  {name}: {len(values)} values, {span}, in place of the task's {sets}")
    print(
        f"{plan.total:,} episodes of up to {max(one.steps for one in plan.cases)} steps: "
        f"{len(plan.cases)} cases (policy on task) x {plan.points:,} points x {plan.episodes} "
        "episodes",
        flush=True,
    )
    if plan.episodes != given["episodes"]:
        print(f"1 episode a point, not {given['episodes']}: no reset draws anything", flush=True)
    return plan
