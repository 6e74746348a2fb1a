"""The suite for optimisers: what is known of its instances, and methods raced on them.

    python -m benchmarks.optimisers --verify [--only ID ...]
    python -m benchmarks.optimisers --finer [--only ID ...]
    python -m benchmarks.optimisers --find [--only ID ...]
    python -m benchmarks.optimisers --bound [--seconds S] [--only ID ...]
    python -m benchmarks.optimisers --costs [--only ID ...]
    python -m benchmarks.optimisers --docs docs/suite.md
    python -m benchmarks.optimisers --race DIR [--workers N]
    python -m benchmarks.optimisers --store DIR | --redraw

--verify: whether each instance is the one that was recorded, and whether the recorded point is
feasible and has the recorded value; leaves with 1 where not. --finer: what the points of the
biped's instances owe to their setting, computed in a sixteenth of its step. --find: looks for
better points by what suits each family and keeps what is better. --bound: what no drive of the UGV
is below, minutes each; kept where it is higher than what was recorded. --costs: measures what an
evaluation costs. --docs: puts the table of instances into a page. --race: all methods on some
instances, into a directory, going on where it holds a part; keeps the runs in benchmarks/results.
--store: keeps those of a race that is not at its end. --redraw: tables and pictures of
docs/optimisers.md from what is kept. Races of one's own: `stickslip bench optimisers`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.optimisers import finer
from benchmarks.optimisers.cost import cost_of
from benchmarks.optimisers.find import found_for, front_for
from benchmarks.report import markdown, options, put_between
from stickslip.dynamics.checks import require_choice
from stickslip.optim import Instance, PostureProblem, bound_every_drive, suite
from stickslip.optim.instances.instance import verified
from stickslip.optim.instances.known import Known, keep
from stickslip.optim.problem import FEASIBLE

MARKS = ("<!-- suite -->", "<!-- end of suite -->")


def find(instance: Instance) -> None:
    """Keep the best of what is found and what was known."""
    digest, known = instance.digest(), instance.known
    cost = {} if known is None else known.cost
    if len(instance.goals) > 1:
        x, how = front_for(instance)
        values = np.array([instance.value(one)[0] for one in x])
        keep(instance.id, Known(np.nan, how, None, "", digest, cost, x=x, front=values))
        print(f"{instance.id}: {len(x)} points of a front", flush=True)
        return
    best = known if known is not None and known.digest == digest else None
    for one in found_for(instance):
        value, _ = instance.value(one.x)
        feasible = instance.problem.free.is_feasible(one.x, FEASIBLE / 2)  # with room for roundings
        print(
            f"{instance.id}: {value[0]:.10g} {'' if feasible else 'NOT FEASIBLE'} by {one.how}"
            + ("" if one.bound is None else f", no less than {one.bound:.10g}"),
            flush=True,
        )
        if feasible and (best is None or value[0] < best.value):
            bound, why = one.bound, one.bound_how
            if bound is None and best is not None:
                bound, why = best.bound, best.bound_how
            best = Known(float(value[0]), one.how, bound, why, digest, cost, x=one.x)
    if best is not None and best is not known:
        keep(instance.id, best)


def bound(instance: Instance, seconds: float | None) -> None:
    """Prove of a drive of the UGV for so long, and write beside what is known."""
    known, problem = instance.known, instance.problem
    if known is None or known.x is None or not isinstance(problem, PostureProblem):
        return
    if len(instance.goals) > 1:
        return
    best = problem.free.expand(known.x)
    found = bound_every_drive(problem, best, seconds=seconds)
    print(
        f"{instance.id}: {known.value:.8g}, no less than {found.value:.8g}, {found.seconds:.0f} s",
        flush=True,
    )
    if np.isfinite(found.value) and (known.bound is None or found.value > known.bound):
        levels = f"{len(found.levels)} level{'s' * (len(found.levels) > 1)}"
        how = f"interval arithmetic over cells of leg angles, {levels}"
        keep(instance.id, replace(known, bound=float(found.value), bound_how=how))


def costs(instance: Instance) -> None:
    """Measure, and write beside what is known."""
    if (known := instance.known) is not None:
        found = cost_of(instance)
        print(f"{instance.id}: {found}", flush=True)
        keep(instance.id, known.with_cost(found))


def verify(names: list[str]) -> bool:
    """Say of every instance whether it is as recorded."""
    sound = True
    for name in names:
        words = verified(suite()[name])
        sound = sound and words.startswith("as recorded")
        print(f"{name}: {words}", flush=True)
    return sound


def table() -> str:
    """Goal, best known value and gap of each instance."""
    rows: list[dict[str, Any]] = []
    for one in suite().values():
        known = one.known
        gap = best = ""
        if known is not None and not np.isnan(known.value):
            best = f"{known.value:.6g}"
        if known is not None and known.bound is not None:
            gap = f"{max(0.0, known.value - known.bound) / max(abs(known.value), 1e-12):.1g}"
        goal = ", ".join(one.goals)
        rows.append({"id": f"`{one.id}`", "goal": goal, "best known": best, "gap to a bound": gap})
    return markdown(rows)


def _races(given: argparse.Namespace) -> None:
    """What is asked of races."""
    if not (given.race or given.store or given.redraw):
        return
    from benchmarks.optimisers import race

    if given.race:
        race.run(given.race, given.workers)
    if given.store:
        race.store(given.store)
    if given.redraw:
        race.redraw()


def main() -> None:
    """Do what is asked."""
    parser = options("optimisers", __doc__)
    parser.add_argument("--only", nargs="*", default=list(suite()), metavar="ID", help="of these")
    for name in ("find", "finer", "verify", "bound", "costs"):
        parser.add_argument(f"--{name}", action="store_true")
    parser.add_argument("--race", type=Path, metavar="DIR", help="race the methods into it")
    parser.add_argument("--workers", type=int, metavar="N", help="processes of the race")
    parser.add_argument("--store", type=Path, metavar="DIR", help="keep the runs of a race")
    parser.add_argument("--redraw", action="store_true", help="from what is kept")
    parser.add_argument(
        "--seconds", type=float, help="of a proof, about: no level begins that would end later"
    )
    parser.add_argument("--docs", type=Path, help="put the table into this page")
    given = parser.parse_args()
    for name in given.only:
        require_choice("--only", name, tuple(suite()))
    _races(given)
    for name in given.only:
        if given.find:
            find(suite()[name])
        if given.finer and name in finer.names():
            print(f"{name}: {finer.owed_by(suite()[name])}", flush=True)
        if given.bound:
            bound(suite()[name], given.seconds)
        if given.costs:
            costs(suite()[name])
    if given.docs is not None:
        put_between(given.docs, f"\n{table()}\n", MARKS)
    if given.verify:
        sys.exit(0 if verify(given.only) else 1)


if __name__ == "__main__":
    main()
