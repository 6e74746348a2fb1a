"""Speed against accuracy of poses: solver, precision and how the ground is interpolated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from typing import Any, NamedTuple

import jax

from benchmarks.timing import Compiled
from benchmarks.ugv import tracks
from benchmarks.ugv.errors import errors_of, truth_of
from benchmarks.ugv.program import Way, given, program, timed
from stickslip.dynamics.ugv import PoseSolver, Track

BATCHES = (1, 1 << 14)
DENSITIES = (1, 2, 4, 8, 16, 32, 64)
"""Pieces a metre of the tables."""
DENSE = 16
"""Of the table that every solver is tried on."""
BARE, CHECKED = PoseSolver(samples=0), PoseSolver()
SOLVERS = (
    CHECKED,
    PoseSolver(iterations=3),
    BARE,
    PoseSolver(samples=0, tolerance=1e-2),
    PoseSolver(samples=0, tolerance=1e-4),
    *(PoseSolver(samples=0, iterations=n) for n in (1, 2, 3, 4)),
)


GROUNDS = {**tracks.EXACT, "sines": tracks.sines}


class Case(NamedTuple):
    """One structure of ground with one solver in one precision: one program for each batch.

    interpolation: "exact", the ground in closed form; "quintic", a table of itself; or a kind of
    Track.from_points. densities: pieces a metre.
    """

    track: str
    interpolation: str
    solver: PoseSolver
    dtype: str
    densities: tuple[int, ...]
    batches: tuple[int, ...]


def cases(quick: bool) -> list[Case]:
    """All that is measured, on the tracks and in both precisions."""
    found = []
    for dtype in ("float64", "float32"):
        for solver in (CHECKED, BARE) if quick else SOLVERS:
            alone = BATCHES if solver in (CHECKED, BARE) else BATCHES[1:]
            found.append(Case("bump", "exact", solver, dtype, (0,), alone))
            densities = DENSITIES if solver in (CHECKED, BARE) else (4, DENSE)
            for track in tracks.EXACT:
                found.append(Case(track, "quintic", solver, dtype, densities, alone))
        if quick:
            continue
        for track in ("rough", "sines"):
            for solver in (CHECKED, BARE):
                found.append(Case(track, "exact", solver, dtype, (0,), BATCHES))
        for kind in ("cubic", "pchip", "makima", "linear"):
            for track in tracks.EXACT:
                found.append(Case(track, kind, BARE, dtype, DENSITIES[1:], BATCHES[1:]))
    return found


def ground_of(case: Case, density: int) -> Track:
    """The case's track; under enable_x64, so that its numbers come in float64."""
    exact = GROUNDS[case.track]()
    if case.interpolation == "exact":
        return exact
    if case.interpolation == "quintic":
        return tracks.tabulated(exact, density)
    return tracks.through_points(exact, density, case.interpolation)


def trade(quick: bool) -> Iterator[dict[str, Any]]:
    """A row for each case, density and batch."""
    with jax.enable_x64(True):
        truths = {name: truth_of(make(), BATCHES[1]) for name, make in GROUNDS.items()}
    programs: dict[tuple, Compiled] = {}
    for case in cases(quick):
        errors: dict[int, dict[str, float]] = {}
        for batch in sorted(case.batches, reverse=True):
            cost: dict[str, float] = {}
            for density in case.densities:
                run, seconds = _program(case, density, batch, programs)
                # All postures are in the large batch; all tables of a case have one size.
                if density not in errors:
                    errors[density] = errors_of(run()._asdict(), truths[case.track])
                cost = cost or _cost(run, batch, seconds)
                yield {**_names(case, density), "batch": batch, **errors[density], **cost}


def _program(case: Case, density: int, batch: int, programs: dict[tuple, Compiled]):
    """A call of the point's program, compiled once for each structure, and its compile seconds."""
    with jax.enable_x64(True):
        ground = ground_of(case, density)
    with jax.enable_x64(case.dtype == "float64"):
        arguments = given(ground, case.dtype, batch)
        shapes = tuple(leaf.shape for leaf in jax.tree.leaves(arguments[0]))
        key = (case.solver, case.dtype, batch, type(ground.shape), shapes)
        if key not in programs:
            programs[key] = program(Way(case.solver), *arguments)
        return partial(programs[key].call, *arguments), programs[key].seconds


def _cost(run, batch: int, compile_seconds: float) -> dict[str, float]:
    processor, wall, seconds = timed(run, compile_seconds)
    return {"cost": processor / batch, "wall": wall / batch, "compile": seconds}


def _names(case: Case, density: int) -> dict[str, Any]:
    return {
        "track": case.track,
        "interpolation": case.interpolation,
        "pieces": density or None,
        "solver": code(case.solver),
        "dtype": case.dtype,
    }


def code(solver: PoseSolver) -> str:
    """The expression that makes a solver; defaults left out."""
    given = [
        f"{one.name}={getattr(solver, one.name)!r}"
        for one in fields(solver)
        if getattr(solver, one.name) != one.default
    ]
    return f"PoseSolver({', '.join(given)})"
