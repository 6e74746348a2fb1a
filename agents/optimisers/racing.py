"""Races: methods x instances of the suite x seeds, in processes of their own; `stickslip bench`."""

import multiprocessing
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from stickslip.agents.optimisers import report
from stickslip.agents.optimisers.methods import METHODS, Optimiser, methods_of
from stickslip.agents.optimisers.worker import Task, begin_worker, make_run, run_of
from stickslip.agents.sweeps import cells
from stickslip.agents.training.directory import only_writer
from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.envs.collecting import cores_here
from stickslip.optim.instances.instance import instance, suite
from stickslip.optim.problem import require_scalar
from stickslip.optim.progress import Bar
from stickslip.records.files import require_folder, require_makeable, write_whole
from stickslip.records.signals import stoppable
from stickslip.records.table import Content

MOST = 10**6
"""Runs of one race."""


def race(
    methods: Iterable[str] | Mapping[str, Optimiser | str],
    instances: str | Iterable[str],
    *,
    budget: int | None = None,
    seconds: float | None = None,
    seeds: int = 3,
    out: str | Path | None = None,
    resume: bool = False,
    workers: int | None = None,
    limit: float = 120.0,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> list[report.Run]:
    """Run every method on every instance that suits it, with every seed; return all runs.

    methods: names of METHODS, or functions by names of one's own. A function takes an Objective
    and a seed; it minimises until the budget ends it or it returns. instances: ids.

    budget: evaluations, values and gradients alike; seconds: of processor time; one of both at
    least. seeds: how many, from 0 on. A run that raises is recorded with what it had found.
    Compiling is not counted. limit: time on the clock [s], compiling included, after which the
    process of a run is killed; such a run, and one that ends its process, has no value.

    out: a directory that keeps each run as it is made; resume: continue with what is missing there.
    workers: processes, one for each core if None. progress: say how many runs there are, and show a
    bar. stop: polled; StoppedError where it returns True. A script that calls this needs
    `if __name__ == "__main__":`, as for any process of multiprocessing.

    ValueError for unknown names, with the nearest, a budget of zero, a directory of something else.
    """
    names = [instances] if isinstance(instances, str) else list(instances)
    tasks, left_out = _tasks(methods, names, seeds, (budget, seconds))
    if resume and out is None:
        raise ValueError("resume without out; accepted: with the directory of the race")
    require_scalar("limit", limit, low=0.0, strict=True, accepted="a time > 0 [s]")
    count = cores_here() if workers is None else require_integer("workers", workers, high=256)
    pickles, pebble = (require(name, "a race", "sweep") for name in ("cloudpickle", "pebble"))
    if progress:
        pairs = f"{len(left_out)} pairs of method and instance do not suit each other"
        print(f"{len(tasks)} runs; {pairs}", flush=True)
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory()) if out is None else ""
        path = Path(folder) / "race" if out is None else Path(out)
        stack.enter_context(only_writer(path, "racing"))
        content = {"definition": _definition(tasks), "cells": len(tasks)}
        head = cells.open_store(path, "race", content, resume)
        todo = cells.missing_cells(path, "race")
        at = len(tasks) - len(todo)
        bar = stack.enter_context(Bar("race", len(tasks), "run", progress, at=at))
        spawn = multiprocessing.get_context("spawn")
        pool = pebble.ProcessPool(count, initializer=begin_worker, context=spawn)
        stack.callback(pool.join)
        stack.callback(pool.stop)  # which kills its processes, first

        def submit(number: int) -> Future[report.Run]:
            return pool.schedule(make_run, args=[pickles.dumps(tasks[number])], timeout=limit)

        def keep(number: int, made: Future[report.Run]) -> None:
            try:
                run = made.result()
            except TimeoutError:
                run = run_of(tasks[number], "timed out", f"{limit:g} s with start and compiling")
            except pebble.ProcessExpired as error:
                run = run_of(tasks[number], "died", str(error))
            cells.write_cell(path, number, head, run.table())
            bar.advance()

        cells.run_cells(submit, keep, todo, stop)
        return report.read_results(path)


def _tasks(
    methods: Iterable[str] | Mapping[str, Optimiser | str],
    names: Sequence[str],
    seeds: int,
    limits: tuple[int | None, float | None],
) -> tuple[list[Task], list[str]]:
    """All runs, and pairs that do not suit each other, with the reason."""
    found = {name: instance(name) for name in names}
    chosen, (budget, seconds) = methods_of(methods), limits
    if budget is not None:
        require_integer("budget", budget, high=2**53)
    if seconds is not None:
        require_scalar("seconds", seconds, low=0.0, strict=True, accepted="a time > 0 [s]")
    if budget is None and seconds is None:
        raise ValueError("neither budget nor seconds; accepted: one of them at least")
    require_integer("seeds", seeds, high=MOST)
    for what, given in (("instance", names), ("method", [one.name for one in chosen])):
        if not given or len(set(given)) < len(given):
            raise ValueError(f"{what}s: {', '.join(given) or 'none'}; accepted: one or more, once")
    pairs = [(name, one, one.unsuited(found[name])) for name in names for one in chosen]
    suited = [(name, one, 1 if one.inside else seeds) for name, one, why in pairs if not why]
    tasks = [Task(name, one, seed, *limits) for name, one, count in suited for seed in range(count)]
    left_out = [f"{one.name} on {name}: {why}" for name, one, why in pairs if why]
    if not 0 < len(tasks) <= MOST:
        raise ValueError(
            f"{len(tasks)} runs ({', '.join(left_out[:1]) or 'too many'}); accepted: methods "
            f"that take an instance, up to {MOST:,} runs"
        )
    return tasks, left_out


def _definition(tasks: Sequence[Task]) -> dict[str, object]:
    """Definition that decides the results, as JSON values; of functions only their names."""
    first, methods = tasks[0], dict.fromkeys(one.method.name for one in tasks)
    return {
        "instances": list(dict.fromkeys(one.instance for one in tasks)),
        "methods": {name: "ours" if name in METHODS else "yours" for name in methods},
        "seeds": max(one.seed for one in tasks) + 1,
        "runs": len(tasks),
        **{name: getattr(first, name) for name in ("budget", "seconds")},
    }


def run_command(flags: Mapping[str, Any]) -> Content:
    """Run methods on instances into a directory."""
    require_folder(flags["out"])
    methods, names = flags["methods"] or list(METHODS), flags["instances"] or list(suite())
    asked = ("out", "budget", "seconds", "seeds", "resume", "workers", "limit")
    given = {name: flags[name] for name in asked}
    message = f"Stopped; go on with the same command and --resume ({flags['out']})"
    with stoppable(message) as stop:
        runs = race(methods, names, **given, progress=True, stop=stop)
    print(report.report_text([*runs, *report.stored_results(runs)]))
    print(f"Plots: stickslip bench report {flags['out']} --stored --out DIR")
    return Content({"closeness": report.closeness_table(runs)}, {"directory": flags["out"]})


def report_command(flags: Mapping[str, Any]) -> Content:
    """Compare runs: tables, ECDF plots."""
    out = Path(flags["out"])
    require_folder(out)
    if out.exists():
        raise ValueError(f"{out} exists; accepted: a new directory")
    require_makeable(out)
    runs = report.read_results(*flags["source"])
    runs += report.stored_results(runs) if flags["stored"] else []
    text = report.report_text(runs)
    print(text)
    written = [write_whole(out / "report.md", text, overwrite=False)]
    names = [str(one) for one in written + report.draw_ecdfs(runs, out)]
    print(f"Written: {', '.join(names)}")
    return Content({"closeness": report.closeness_table(runs)}, {"written": names})
