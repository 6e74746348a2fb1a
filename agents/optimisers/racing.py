"""Races: methods on instances of the suite with seeds, in processes that can be killed."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from stickslip.agents.optimisers.directory import LIBRARIES, missing_runs, open_race, run_path
from stickslip.agents.optimisers.names import FAILED
from stickslip.agents.optimisers.plan import RacePlan
from stickslip.agents.optimisers.reading import read_runs
from stickslip.agents.optimisers.results import Run, table_of
from stickslip.agents.optimisers.seat import Seats
from stickslip.agents.sweeps.files.directory import versions
from stickslip.agents.sweeps.files.parquet import write_chunk
from stickslip.agents.sweeps.playing.engine import Watch, run_here
from stickslip.agents.sweeps.playing.progress import Progress
from stickslip.agents.training.directory import only_writer
from stickslip.dynamics.checks import require_integer
from stickslip.envs.collecting import cores_here
from stickslip.envs.rendering.extras import require
from stickslip.optim.progress import say_stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from jaxtyping import PyTree

    from stickslip.agents.optimisers.method import Method, Optimiser
    from stickslip.agents.optimisers.task import Task

LIMIT = 120.0


def race(
    methods: Iterable[str] | Mapping[str, Optimiser | str | Method],
    instances: str | Iterable[str],
    *,
    budget: int | None = None,
    seconds: float | None = None,
    seeds: int | Sequence[int] = 3,
    outside: Literal["clip", "refuse"] = "clip",
    limit: float = LIMIT,
    out: str | Path | None = None,
    resume: bool = False,
    again: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
    report: bool = True,
) -> list[Run]:
    """Run every method on every instance that suits it, with every seed; all runs there are.

    methods: names of METHODS, or functions by names of one's own. A function takes an Objective
    and, if it has two arguments, the seed; it minimises until the budget ends it or it returns.
    instances: ids. budget: evaluations, values and gradients alike; seconds: of processor time; one
    of both at least. seeds: how many, or which. outside: see Objective.

    limit: what a run may take on the clock [s]: one that takes longer is killed, also inside C
    code, and recorded with what it had found ("timed out"), as are those that raise or whose
    process ends; the others go on. What is compiled counts in neither.

    out: a directory that keeps each run as it is made; resume: go on with what is missing there,
    and, with again, with those that failed. workers: processes here, one for each core if None;
    scheduler: the address of a Dask scheduler, whose workers do it. progress: a bar, or lines.
    stop: asked now and then; StoppedError where it says so. report: with out, report.html is
    written there at the end, of all its runs: tables, curves, and the best point of up to six
    instances played. Where that fails, a RuntimeWarning says so.

    ValueError for unknown names, with the nearest, a budget of zero, a directory of something else.
    """
    plan = RacePlan.of(
        methods,
        instances,
        budget=budget,
        seconds=seconds,
        seeds=seeds,
        outside=outside,
        limit=limit,
    )
    how = {"resume": resume, "again": again, "workers": workers, "scheduler": scheduler}
    if out is not None:
        runs = run_race(plan, Path(out), progress=progress, stop=stop, **how)
        if report:
            from stickslip.agents.reports.raced import report_race

            report_race(runs, Path(out), say_stage if progress else lambda stage: None)
        return runs
    if resume or again:
        raise ValueError("resume without out; accepted: with the directory of the race")
    with tempfile.TemporaryDirectory() as folder:
        return run_race(plan, Path(folder) / "race", progress=progress, stop=stop, **how)


def run_race(
    plan: RacePlan,
    path: Path,
    *,
    resume: bool = False,
    again: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
) -> list[Run]:
    """`race`, of a plan."""
    if workers is not None:
        require_integer("workers", workers, high=256)
    if scheduler is not None and workers is not None:
        raise ValueError("workers and scheduler; accepted: one of them")
    require("cloudpickle", "a race", "sweep")
    with only_writer(path, "racing"):
        open_race(path, plan, resume=resume)
        every, todo = range(len(plan.tasks)), missing_runs(path, plan)
        kept: dict[int, Run] = {}
        if again:
            held = _read(path, {*every} - {*todo})
            kept = {index: run for index, run in held.items() if run.outcome not in FAILED}
            todo = [index for index in every if index not in kept]
        done = len(plan.tasks) - len(todo)
        work = Runs(plan, path)
        with Progress(len(plan.tasks), done, progress, name="race", unit="run") as told:
            watch = Watch(told.advance, stop)
            try:
                if scheduler is None:
                    run_here(work, todo, workers or cores_here(), watch)
                else:
                    from stickslip.agents.sweeps.playing.cluster import run_beyond

                    run_beyond(work, todo, watch, scheduler=scheduler)
            finally:
                work.close()
        found = kept | _read(path, {*every} - {*kept})
        return [found[index] for index in every]


def _read(path: Path, indices: Iterable[int]) -> dict[int, Run]:
    """Runs of a directory by their numbers."""
    return {index: read_runs(run_path(path, index))[0] for index in indices}


class Runs:
    """A plan's runs as pieces of work; see `sweeps.engine.Work`. Every thread has a Seat."""

    def __init__(self, plan: RacePlan, path: Path):
        self._plan, self._path = plan, path
        self.digest, self.count = plan.digest, len(plan.tasks)
        self._seats, self._versions = Seats(plan.limit), versions(LIBRARIES)

    def size(self, index: int) -> int:
        """One."""
        return 1

    def play(
        self,
        index: int,
        device: PyTree,
        advance: Callable[[int], None],
        stop: Callable[[], bool],
    ) -> Run:
        """Make a run."""
        found = self._seats.here().run(self._plan.tasks[index], stop)
        advance(1)
        return found

    def keep(self, index: int, found: Run) -> None:
        """Write it."""
        own = {"digest": self.digest, "chunk": index, "race": self._versions}
        write_chunk(run_path(self._path, index), table_of([found], own))

    def sent(self) -> bytes:
        """The tasks, with what makes the runs."""
        parts = partial(_running, self._plan.tasks, self._plan.limit)
        return require("cloudpickle", "a race", "sweep").dumps(parts)

    def close(self) -> None:
        """End the processes."""
        self._seats.close()


def _running(tasks: tuple[Task, ...], limit: float) -> Callable[[int], Run]:
    """What makes runs by their numbers, in a worker: a Seat for each of its threads."""
    seats = Seats(limit)
    return lambda index: seats.here().run(tasks[index])
