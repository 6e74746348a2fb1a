"""Races: methods x instances of the suite x seeds, in processes that can be killed."""

from __future__ import annotations

import json
import tempfile
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import cached_property, partial
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from typing import TYPE_CHECKING, Literal, TypedDict, Unpack

from stickslip.agents.optimisers.methods import METHODS, methods_of
from stickslip.agents.optimisers.runs import Run, read_runs, table_of
from stickslip.agents.optimisers.task import Task
from stickslip.agents.optimisers.worker import Worker
from stickslip.agents.sweeps.cells import missing_cells, open_store, run_cells, write_cell
from stickslip.agents.training.directory import only_writer
from stickslip.dynamics.checks import nearest, require_choice, require_integer, require_kind, shown
from stickslip.envs.collecting import cores_here
from stickslip.envs.rendering.extras import require
from stickslip.optim.instances.catalogue import suite
from stickslip.optim.instances.objective import OUTSIDE
from stickslip.optim.options import require_scalar
from stickslip.optim.progress import Bar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from stickslip.agents.optimisers.methods import Method, Optimiser

    Methods = Iterable[str] | Mapping[str, Optimiser | str | Method]

LIMIT = 120.0
MOST, LAST_SEED = 10**6, 2**31 - 1
"""Runs of one race; the greatest seed."""


class Limits(TypedDict, total=False):
    """Limits of the runs, see `race`."""

    budget: int | None
    seconds: float | None
    seeds: int | Sequence[int]
    outside: Literal["clip", "refuse"]
    limit: float


@dataclass(frozen=True)
class RacePlan:
    """All runs of a race. left_out: pairs that do not suit each other, and why."""

    tasks: tuple[Task, ...]
    left_out: tuple[str, ...]
    limit: float

    @classmethod
    def of(
        cls,
        methods: Methods,
        instances: str | Iterable[str],
        *,
        budget: int | None = None,
        seconds: float | None = None,
        seeds: int | Sequence[int] = 3,
        outside: Literal["clip", "refuse"] = "clip",
        limit: float = LIMIT,
    ) -> RacePlan:
        """Check the arguments of `race`."""
        names = [instances] if isinstance(instances, str) else list(instances)
        for name in names:
            if name not in suite():
                raise ValueError(
                    f"instance {shown(name)} is unknown{nearest(str(name), suite())}; accepted: "
                    "ids of docs/suite.md"
                )
        chosen = methods_of(methods)
        if budget is not None:
            require_integer("budget", budget, high=2**53)
        if seconds is not None:
            require_scalar("seconds", seconds, low=0.0, strict=True, accepted="a time > 0 [s]")
        if budget is None and seconds is None:
            raise ValueError("neither budget nor seconds; accepted: one of them at least")
        require_scalar("limit", limit, low=0.0, strict=True, accepted="a time > 0 [s]")
        require_choice("outside", outside, OUTSIDE)
        for what, given in (("instance", names), ("method", [one.name for one in chosen])):
            if not given:
                raise ValueError(f"no {what}s; accepted: one at least")
            if twice := next((one for one in given if given.count(one) > 1), None):
                raise ValueError(f"{what} {twice} is given twice; accepted: once")
        tasks, left_out, numbers = [], [], _seeds(seeds)
        for name in names:
            for one in chosen:
                if why := one.unsuited(suite()[name]):
                    left_out.append(f"{one.name} on {name}: {why}")
                    continue
                own = numbers if one.seeded else numbers[:1]
                tasks += [Task(name, one, seed, budget, seconds, outside) for seed in own]
        if not 0 < len(tasks) <= MOST:
            raise ValueError(
                f"{len(tasks)} runs ({', '.join(left_out[:1]) or 'too many'}); accepted: methods "
                f"that take an instance, up to {MOST:,} runs"
            )
        return cls(tuple(tasks), tuple(left_out), float(limit))

    @cached_property
    def definition(self) -> dict[str, object]:
        """Definition that decides the results, as JSON values; of functions only their names."""
        first = self.tasks[0]
        methods = {one.method.name: one.method for one in self.tasks}
        found = {
            "instances": list(dict.fromkeys(one.instance for one in self.tasks)),
            "methods": {
                name: asdict(one) | {"function": "ours" if name in METHODS else "yours"}
                for name, one in methods.items()
            },
            "seeds": sorted({one.seed for one in self.tasks}),
            "runs": len(self.tasks),
            "budget": first.budget,
            "seconds": first.seconds,
            "outside": first.outside,
        }
        return json.loads(json.dumps(found, allow_nan=False))


def race(
    methods: Methods,
    instances: str | Iterable[str],
    *,
    out: str | Path | None = None,
    resume: bool = False,
    workers: int | None = None,
    progress: bool = False,
    stop: Callable[[], bool] = lambda: False,
    **limits: Unpack[Limits],
) -> list[Run]:
    """Run every method on every instance that suits it, with every seed; return all runs.

    methods: names of METHODS, or functions by names of one's own. A function takes an Objective
    and, if it has two arguments, the seed; it minimises until the budget ends it or it returns.
    instances: ids.

    out: a directory that keeps each run as it is made; resume: continue with what is missing there.
    workers: processes, one for each core if None.
    progress: show a bar. stop: polled; StoppedError where it returns True.

    budget: evaluations, values and gradients alike; seconds: of processor time; one of both at
    least. seeds: how many, or which (default: 3). outside: see Objective. limit: time on the clock
    [s] (default: 120) after which a run is killed, also inside C code, and recorded with what it
    had found ("timed out"), as are those that raise or whose process ends. Compiling is not
    counted.

    ValueError for unknown names, with the nearest, a budget of zero, a directory of something else.
    """
    plan = RacePlan.of(methods, instances, **limits)
    if resume and out is None:
        raise ValueError("resume without out; accepted: with the directory of the race")
    threads = cores_here() if workers is None else require_integer("workers", workers, high=256)
    require("cloudpickle", "a race", "sweep")
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory()) if out is None else ""
        path = Path(folder) / "race" if out is None else Path(out)
        stack.enter_context(only_writer(path, "racing"))
        count = len(plan.tasks)
        head = open_store(
            path, "race", definition=plan.definition, cells=count, about={}, resume=resume
        )
        todo, ended, idle = missing_cells(path, "race"), Event(), SimpleQueue[Worker]()
        bar = stack.enter_context(Bar("race", count, "run", progress, at=count - len(todo)))

        def play(number: int) -> Run:
            worker = idle.get()
            try:
                return worker.run(plan.tasks[number], ended.is_set)
            finally:
                idle.put(worker)

        def keep(number: int, run: Run) -> None:
            write_cell(path, number, head, table_of([run]))
            bar.advance()

        for _ in range(threads):
            idle.put(worker := Worker(plan.limit))
            stack.callback(worker.close)
        pool = stack.enter_context(ThreadPoolExecutor(threads))
        stack.callback(ended.set)  # before the pool waits for its runs
        run_cells(partial(pool.submit, play), keep, todo, stop)
        return read_runs(path)


def _seeds(given: int | Sequence[int]) -> list[int]:
    """That many seeds from 0 on, or the given ones."""
    if isinstance(given, int):
        return list(range(require_integer("seeds", given, high=MOST)))
    require_kind("seeds", given, (list, tuple, range), "how many, or a list of them")
    if not given or len(set(given)) < len(given):
        raise ValueError(f"seeds = {list(given)}; accepted: one at least, each once")
    return [require_integer("seed", one, low=0, high=LAST_SEED) for one in given]
