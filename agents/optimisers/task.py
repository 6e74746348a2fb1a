"""One run: an instance, a method, a seed; made ready before, so that its time has no compiling."""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.agents.optimisers.merit import Merit
from stickslip.agents.optimisers.watched import Event, Watched
from stickslip.optim.instances.catalogue import instance as instance_by_id
from stickslip.optim.instances.record import BudgetSpent

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Literal

    from stickslip.agents.optimisers.method import Method
    from stickslip.optim.instances.objective import Objective

TRIED = 6
"""Evaluations of a trial before the first run, besides two batches."""
MESSAGE = 200
RAISED = (Exception, SystemExit, KeyboardInterrupt)
"""Whatever an optimiser may raise; sys.exit() in it must not end the process that serves it."""


@dataclass(frozen=True)
class Task:
    """A run to be made. budget: evaluations, or None; seconds: of processor time, or None; outside:
    as an Objective's."""

    instance: str
    method: Method
    seed: int
    budget: int | None
    seconds: float | None
    outside: Literal["clip", "refuse"] = "clip"


class Ending(NamedTuple):
    """How a run ended: one of OUTCOMES and a message; its last Event, its counters, the time it
    took on the clock [s], and the instance's digest."""

    outcome: str
    message: str
    last: Event
    counts: dict[str, int]
    wall_seconds: float
    digest: str


COUNTS = ("values", "gradients", "batches", "clipped", "refused", "not_numbers")
"""Counters of a record that results hold."""


def make_ready(task: Task) -> None:
    """Compile what the objective needs: once for each instance, method and process."""
    _objective_ready(task.instance, task.method.batch, task.method.slopes)


def try_out(task: Task) -> None:
    """Have the method compile what is its own, on an objective that nobody counts."""
    _tried(task.instance, task.method, task.budget, task.outside)


@cache
def _objective_ready(name: str, batch: int, slopes: bool) -> None:
    one = instance_by_id(name)
    objective = one.objective()
    objective(objective.middle)
    if batch > 1:
        objective.batch(np.tile(objective.middle, (batch, 1)))
    if slopes or objective.has_slopes:
        objective.gradient(objective.middle)
        objective.jacobian(objective.middle)
    if one.flags.noisy:
        one.value(objective.middle)


@cache
def _tried(
    name: str, method: Method, budget: int | None, outside: Literal["clip", "refuse"]
) -> None:
    few = TRIED + 2 * method.batch if method.batch > 1 else TRIED
    few = few if budget is None else min(few, budget)
    objective = instance_by_id(name).objective(budget=few, outside=outside)
    with suppress(*RAISED):  # it will be told of in the run itself
        method.run(objective, 0)


def run_task(task: Task, tell: Callable[[Event], None]) -> Ending:
    """Run it, telling of every step on the way."""
    one = instance_by_id(task.instance)
    record = Watched(merit=Merit(one), tell=tell)
    objective = one.objective(
        budget=task.budget,
        seconds=task.seconds,
        outside=task.outside,
        seed=task.seed,
        record=record,
    )
    began = time.perf_counter()
    outcome, message = _outcome(task, objective)
    last, took = record.end(), time.perf_counter() - began
    counts = {name: int(getattr(record, name)) for name in COUNTS}
    return Ending(outcome, message, last, counts, took, one.digest())


def _outcome(task: Task, objective: Objective) -> tuple[str, str]:
    try:
        task.method.run(objective, task.seed)
    except RAISED as error:
        if _is_spent(error):
            return "spent", ""
        words = " ".join(f"{type(error).__name__}: {error}".split())
        return "raised", words[:MESSAGE]
    return "ended", ""


def _is_spent(error: BaseException) -> bool:
    """Whether it is the end of the budget, or was raised because of it."""
    seen: list[BaseException] = []
    while error not in seen:
        if isinstance(error, BudgetSpent):
            return True
        seen.append(error)
        error = error.__cause__ or error.__context__ or error
    return False
