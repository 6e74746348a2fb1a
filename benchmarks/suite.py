"""Known solutions of the suite's instances from races, and the table of the instances.

`python -m benchmarks.suite --runs runs/seeded` takes the best feasible points of a race into the
suite's files, with a bound of each where one can be proved, and keeps the runs in the package.
`python -m benchmarks.suite --docs docs/suite.md` writes the table into a page.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from pyarrow import parquet

from benchmarks.report import markdown, put_between
from stickslip.agents.optimisers.report import STORED, Run, grouped, read_results
from stickslip.optim import bound_every_drive, suite
from stickslip.optim.gait.convex.conic import best_of
from stickslip.optim.gait.problem import GaitProblem
from stickslip.optim.instances.biped import Interpolated
from stickslip.optim.instances.instance import AGREED, POINTS, VALUES, instance
from stickslip.optim.instances.ugv import FRICTION, SplitProblem
from stickslip.optim.posture.problem import PostureProblem
from stickslip.records.files import write_whole, writing


def known_of(runs: list[Run], old: dict[str, Any]) -> tuple[dict[str, Any], np.ndarray | None]:
    """The entry of VALUES of feasible runs, and its point; None: the old one's, which is better."""
    one = instance(runs[0].instance)
    point: Any = min(runs, key=lambda run: run.best).point
    (value, *_), feasible = one.value(point)
    best = min(float(value) if feasible else np.inf, old.get("value", np.inf))
    close = {run.method: "" for run in runs if run.best - best <= AGREED * abs(best)}
    if best < value:
        return old | {"methods": max(len(close), 1)}, None
    entry = {"value": best, "how": ", ".join(close), "methods": len(close)}
    usual = {"bound": None, "bound_how": "", "digest": one.digest()}
    return usual | old | entry, point


def bound_of(name: str, point: np.ndarray) -> tuple[float | None, str]:
    """A lower bound of an instance, and how it is proved; None where none is, or it says little."""
    problem: Any = instance(name).problem
    if isinstance(problem, SplitProblem):
        return split_bound(problem), "each station by itself"
    if isinstance(problem, GaitProblem | Interpolated):
        answer: Any = best_of(problem.on_grid, every=False)
        # Violations of 1e-6, which count as feasible, are worth less than that on all instances.
        return (1 - 3e-4) * answer.certificate.bound, "dual of the convex program"
    if isinstance(problem, PostureProblem):
        bound = bound_every_drive(problem, problem.free.expand(point), tolerance=0.04).value
        return bound, "interval arithmetic over cells of leg angles"
    return None, ""


def split_bound(problem: SplitProblem) -> float:
    """The least value, from that of each station: a convex function of one number, whose least is
    at an end of the interval with grip, at a corner, or at the bottom of its parabola."""
    drive, squared = problem.data, problem.function.__name__ == "_squared"
    (F, N), (dF, dN) = ((of[:, ::2], of[:, 1::2]) for of in drive[:2])
    margins, slopes = (
        np.hstack([FRICTION * n - f, FRICTION * n + f, n]) for f, n in ((F, N), (dF, dN))
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        edges = -margins / slopes
        low = np.max([problem.low, *np.where(slopes > 0, edges, -np.inf).T], axis=0)
        high = np.min([problem.high, *np.where(slopes < 0, edges, np.inf).T], axis=0)
        equal = [(F[:, 0] - s * F[:, 1]) / (s * dF[:, 1] - dF[:, 0]) for s in (1, -1)]
        bottom = -np.sum(F * dF, 1) / np.sum(dF**2, 1)
        points = np.nan_to_num([low, high, bottom, *(-F / dF).T, *equal])
    force = (F + np.clip(points, low, high)[..., None] * dF) * drive.torque
    each = np.min(np.sum(force**2, -1) if squared else np.max(abs(force), -1), axis=0)
    return (1 - 1e-9) * float(np.sum(each) if squared else np.max(each))  # less than its rounding


def learn(runs: list[Run]) -> None:
    """Take the best points of races into the suite's files; better values and bounds stay."""
    by_instance = grouped([run for run in runs if np.isfinite(run.best)], lambda run: run.instance)
    file, points = json.loads(VALUES.read_text("utf-8")), dict(np.load(POINTS))
    known = file["instances"]
    for name, of in by_instance.items():
        known[name], point = known_of(of, known.get(name, {}))
        points |= {} if point is None else {name: point}
    with writing(POINTS) as content:
        np.savez_compressed(content, **points)
    write_whole(VALUES, json.dumps(file, indent=1) + "\n")
    for name in sorted(by_instance):
        if known[name]["bound"] is None:
            known[name]["bound"], known[name]["bound_how"] = bound_of(name, points[name])
            print(f"{name}: {known[name]['value']:.6g}, bound {known[name]['bound']}", flush=True)
            write_whole(VALUES, json.dumps(file, indent=1) + "\n")


def table() -> str:
    """Goal, best known value of each instance and what stands behind it."""
    rows: list[dict[str, Any]] = []
    for one in suite().values():
        known: Any = one.known
        best = {"best known": f"{known.value:.6g}", "it is": known.standing}
        if np.isnan(known.value):
            best = {"best known": "", "it is": "a front of points"}
        rows.append({"id": f"`{one.id}`", "goal": ", ".join(one.goals)} | best)
    return markdown(rows)


if __name__ == "__main__":
    parser = ArgumentParser(prog="python -m benchmarks.suite")
    parser.add_argument("--docs", type=Path, help="put the table into this page")
    parser.add_argument("--runs", type=Path, nargs="+", help="races to take known solutions from")
    asked = parser.parse_args()
    if asked.runs:
        runs = read_results(*asked.runs)
        learn(runs)
        whole = pa.concat_tables([run.table() for run in runs], promote_options="default")
        with writing(STORED) as content:
            parquet.write_table(whole, content, compression="zstd")
    if asked.docs:
        put_between(asked.docs, f"\n{table()}\n", "suite")
