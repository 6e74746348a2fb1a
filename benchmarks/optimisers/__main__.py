"""The suite for optimisers: what is known of its instances.

    python -m benchmarks.optimisers --verify [--only ID ...]
    python -m benchmarks.optimisers --find [--only ID ...]
    python -m benchmarks.optimisers --bound [--seconds S] [--only ID ...]
    python -m benchmarks.optimisers --docs docs/suite.md

--verify: compare each instance with its recorded digest, and its recorded point with the recorded
value; exit status 1 where one differs. --find: look for better points by what suits each family.
--bound: prove lower bounds of the UGV's instances, minutes each; kept where higher than before.
--docs: put the table of instances into a page.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

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


def main() -> None:
    """Do what is asked."""
    parser = options("optimisers", __doc__)
    parser.add_argument("--only", nargs="*", default=list(suite()), metavar="ID", help="of these")
    for name in ("find", "verify", "bound"):
        parser.add_argument(f"--{name}", action="store_true")
    parser.add_argument("--seconds", type=float, help="of a proof, about")
    parser.add_argument("--docs", type=Path, help="put the table into this page")
    given = parser.parse_args()
    for name in given.only:
        require_choice("--only", name, tuple(suite()))
        if given.find:
            find(suite()[name])
        if given.bound:
            bound(suite()[name], given.seconds)
    if given.docs is not None:
        put_between(given.docs, f"\n{table()}\n", MARKS)
    if given.verify:
        sys.exit(0 if verify(given.only) else 1)


if __name__ == "__main__":
    main()
