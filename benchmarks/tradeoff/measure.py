"""Runs the cases: errors against the references, time, compile time, memory."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import jax
import numpy as np

from benchmarks.timing import CORES, built, on_threads, seconds_of
from benchmarks.tradeoff.cases import Case, cases, code
from benchmarks.tradeoff.errors import (
    Reference,
    errors_of,
    event_errors,
    events_of,
    long_walk_check,
    reference_of,
)
from benchmarks.tradeoff.program import model_of, roll, roll_batch, spread, table_bytes, traced
from benchmarks.tradeoff.scenes import PERIOD, WALKS, Walk

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

CHECK = "long walk beside a quadrature [rad]"
PATIENCE = 0.1
"""About how long a timed run of a batch takes [s]; it is repeated three times."""


def measure(
    quick: bool,
    say: Callable[[str], None],
    keep: Callable[[dict[str, Any]], None],
    had: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """All of it: the references' own checks, a row for every point, one for every program.

    say: told of every step. keep: given what there is after every case. had: what an earlier run
    found, of which only the points that it lacks are then measured.
    """
    had = had or {"checks": {}, "rows": [], "programs": []}
    listed = [case for case in (lacking(c, had["rows"]) for c in cases(quick)) if case.walks]
    references = references_of({name for case in listed for name in case.walks}, say)
    check = had["checks"].get(CHECK)
    if "long" in references:
        check = long_walk_check(WALKS["long"], references["long"])
    rows, programs = list(had["rows"]), list(had["programs"])
    found = {"checks": {CHECK: check}, "rows": rows, "programs": programs}
    begun = time.perf_counter()
    for index, case in enumerate(listed):
        say(
            f"[{index + 1}/{len(listed)}, {time.perf_counter() - begun:.0f} s] "
            f"{code(case.fidelity)} {code(case.integrator)} {case.dtype}"
        )
        for structure in dict.fromkeys(WALKS[name].structure for name in case.walks):
            walks = [WALKS[n] for n in case.walks if WALKS[n].structure == structure]
            new, program = of_structure(case, walks, references)
            _put(rows, new, ("scene", "fidelity", "integrator", "dtype", "dt"))
            _put(programs, [program], ("structure", "fidelity", "integrator", "dtype"))
            say(_line(structure, new, program))
        keep(found)
    return found


def lacking(case: Case, rows: list[dict[str, Any]]) -> Case:
    """The case with only the walks of which some row or cost is not there."""

    def complete(walk: str) -> bool:
        names = {**names_of(case), "scene": walk}
        own = [row for row in rows if names.items() <= row.items()]
        wanted = {PERIOD / count for count in case.counts_on(walk)}
        costs = ("cost_1", "cost_4096") if walk in case.batched else ("cost_1",)
        return wanted <= {row["dt"] for row in own if all(cost in row for cost in costs)}

    walks = tuple(walk for walk in case.walks if not complete(walk))
    return replace(case, walks=walks)


def _put(rows: list[dict[str, Any]], new: list[dict[str, Any]], names: tuple[str, ...]) -> None:
    """Append the new rows; older ones of the same names go."""
    fresh = {tuple(row[name] for name in names) for row in new}
    rows[:] = [row for row in rows if tuple(row[name] for name in names) not in fresh] + new


def references_of(names: Iterable[str], say: Callable[[str], None]) -> dict[str, Reference]:
    """The reference of every walk; ValueError for one that leaves the model."""
    found = {}
    for name in (name for name in WALKS if name in set(names)):
        begun = time.perf_counter()
        found[name] = reference_of(WALKS[name])
        if found[name].status > 1:
            raise ValueError(f"the walk {name!r} ends with status {found[name].status}")
        say(f"reference of {name}: {time.perf_counter() - begun:.0f} s")
    return found


def of_structure(
    case: Case, walks: list[Walk], references: dict[str, Reference]
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Every walk on one kind of floor with every step size: rows, and the programs' sizes."""
    with jax.enable_x64(case.dtype == "float64"), jax.numpy_dtype_promotion("strict"):
        model = model_of(case.fidelity, case.dtype)
        rows, singles = _singles(case, model, walks, references)
        batch = _batches(case, model, walks, references, rows)
    program = {
        "structure": walks[0].structure,
        **names_of(case),
        "coefficient_bytes": table_bytes(model),
        "compile_1": singles.seconds,
        "bytes_1": singles.bytes,
        "batch": None if batch is None else case.batch,
        "compile_batch": None if batch is None else batch.seconds,
        "bytes_batch": None if batch is None else CORES * batch.bytes,
    }
    return rows, program


def names_of(case: Case) -> dict[str, str]:
    """What was chosen, as code."""
    return {
        "fidelity": code(case.fidelity),
        "integrator": code(case.integrator),
        "dtype": case.dtype,
    }


def _singles(case: Case, model, walks: list[Walk], references):
    """One environment at a time: errors and the first cost."""
    rows = []
    shapes = (*_given(case, model, walks[0]), *traced(case.dtype, PERIOD, 1, 1, 1))
    program, recording = built(partial(roll, case.integrator), *shapes), None
    if walks[0].structure in case.events:
        recording = built(partial(roll, replace(case.integrator, record_events=True)), *shapes)
    for walk in walks:
        given = _given(case, model, walk)
        for count in case.counts_on(walk.name):
            dt = PERIOD / count
            numbers = traced(case.dtype, dt, count, walk.periods, walk.stride)
            run = partial(program.call, *given, *numbers)
            rolled = jax.block_until_ready(run())
            processor, wall = seconds_of(run, 1 if walk.name == "long" else 5)
            row = {
                "scene": walk.name,
                **names_of(case),
                "dt": dt,
                "cost_1": processor / walk.duration,
                "wall_1": wall / walk.duration,
            }
            row |= errors_of(walk, rolled, references[walk.name])
            if recording is not None and row["angle_error"] is not None:
                events = events_of(recording.call(*given, *numbers))
                row |= event_errors(events, references[walk.name])
            rows.append(row)
    return rows, program


def _given(case: Case, model, walk: Walk) -> tuple:
    return model, walk.scene(case.dtype), walk.law(case.dtype), walk.start(case.dtype)


def _batches(case: Case, model, walks: list[Walk], references, rows: list[dict[str, Any]]):
    """The second cost, into the rows of the short walks."""
    program = None
    for walk in walks:
        if walk.name not in case.batched:
            continue
        samples, each = references[walk.name].samples, case.batch // CORES
        states = spread(walk, samples, each, case.dtype)
        given = (model, walk.scene(case.dtype), walk.law(case.dtype), states)
        if program is None:
            program = built(
                partial(roll_batch, case.integrator), *given, *traced(case.dtype, PERIOD, 1, 1)
            )
        for row in (row for row in rows if row["scene"] == walk.name):
            count = round(PERIOD / row["dt"])
            row |= _cost_of_batch(program.call, given, case.dtype, row["dt"], count, each)
    return program


def _cost_of_batch(call, given, dtype: str, dt: float, count: int, each: int):
    """Seconds for each simulated second and environment; the share still walking."""

    def run(periods: int):
        one = partial(call, *given, *traced(dtype, dt, count, periods))
        return on_threads([one] * CORES)

    once, _ = seconds_of(lambda: run(1), 1)
    periods = int(np.clip(CORES * PATIENCE / once, 1, 50))
    _, status = run(periods)[0]
    processor, wall = seconds_of(lambda: run(periods), 3)
    simulated = CORES * each * periods * PERIOD
    return {
        "cost_4096": processor / CORES / simulated,
        "wall_4096": wall / simulated,
        "batch_measured": CORES * each,
        "running": float(np.mean(np.asarray(status) <= 1)),
    }


def _line(structure: str, rows: list[dict[str, Any]], program: dict[str, Any]) -> str:
    shown = ", ".join(
        "left the model" if row["angle_error"] is None else f"{row['angle_error']:.0e}"
        for row in rows
    )
    return f"    {structure}: compiled in {program['compile_1']:.1f} s; errors [rad/s] {shown}"
