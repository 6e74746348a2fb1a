"""The best feasible point that can be found for an instance, by what suits its family."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import GaitProblem, Instance, solve
from stickslip.optim.posture.pareto import pareto_front
from stickslip.optim.suite.exports import as_cvxpy, as_scipy
from stickslip.optim.suite.families.split import drive_family
from stickslip.optim.torque_split import TorqueSplit

SEEDS = 3
EVALUATIONS = 6000
SHARES = np.linspace(0.02, 0.98, 13)


class Found(NamedTuple):
    """A point in free numbers, how it was found, and what is proved: a bound and why."""

    x: np.ndarray
    how: str
    bound: float | None = None
    bound_how: str = ""


def found_for(instance: Instance) -> Iterator[Found]:
    """Points for an instance with one goal, each of another method."""
    yield from {
        "posture": _posture,
        "split": _split,
        "gait": _gait,
        "shooting": _searched,
        "gains": _drawn,
        "design": _searched,
    }[instance.family](instance)


def front_for(instance: Instance) -> tuple[np.ndarray, str]:
    """Free numbers [points, n] of a front, and how they were found."""
    problem = instance.problem
    if isinstance(problem, GaitProblem):
        rows = []
        for share in SHARES:
            weights = {"time": float(share), "energy": float(1 - share)}
            rows.append(solve(replace(problem, objective_asked=weights)).x)
        return problem.free.reduce(np.array(rows)), "conic, 13 weights"
    first, second = (one.criterion.name for one in instance.problems)
    front = pareto_front(problem, first, second, points=21)
    return problem.free.reduce(front.x), "dp over its usual grid, 21 points"


def _posture(instance: Instance) -> Iterator[Found]:
    problem = instance.problem
    begun = solve(problem, "dp")
    starts = [begun.x]
    yield Found(problem.free.reduce(begun.x), "dp and polishing")
    for method in ("scp", "gradient"):
        if method == "gradient" and problem.n > 300:
            continue
        result = solve(problem, method, start=starts[-1])
        if result.x is not None:
            starts.append(result.x)
            yield Found(problem.free.reduce(result.x), f"dp, then {method}")


def _split(instance: Instance) -> Iterator[Found]:
    problem, x = as_cvxpy(instance)
    problem.solve(solver="CLARABEL")
    _, track, *words, size, _ = instance.id.split("-")
    criterion = "_".join(words)
    params = UGVParams()
    with jax.enable_x64(True):
        splits = TorqueSplit(criterion).along(params, drive_family(track, int(size[1:])))
    bounds = [one.lower_bound for one in splits]
    joined = {"squared_torque": sum, "peak_torque": max}[criterion]
    within = np.clip(x(), *instance.problem.bounds)
    proved = None if None in bounds else float(joined(bounds))
    yield Found(within, "cvxpy with Clarabel", proved, "dual of each station")
    each = np.clip([one.difference / float(params.weight) for one in splits], -1, 1)
    yield Found(each, "each station by itself", proved, "dual of each station")


def _gait(instance: Instance) -> Iterator[Found]:
    result = solve(instance.problem, "conic")
    yield Found(result.x, "conic", result.lower_bound, f"dual, of {result.bound_of}")


def _searched(instance: Instance) -> Iterator[Found]:
    """Evolution from several seeds, and SLSQP from what it found and from the middle."""
    import cma

    def slsqp(x: np.ndarray) -> np.ndarray | None:
        polish = instance.objective(budget=600)
        polish.minimise(
            lambda it: minimize(**as_scipy(it, x), method="SLSQP", options={"maxiter": 200})
        )
        return polish.record.best_x

    first = slsqp(instance.objective().middle)
    if first is not None:
        yield Found(first, "SLSQP from the middle")
    for seed in range(1, SEEDS + 1):
        search = instance.objective(budget=EVALUATIONS)

        def evolve(it=search, seed=seed) -> None:
            strategy = cma.CMAEvolutionStrategy(
                np.full(it.n, 0.5),
                0.25,
                {"bounds": [0, 1], "seed": seed, "verbose": -9, "popsize": 32},
            )
            while not strategy.stop():
                asked = strategy.ask()
                strategy.tell(asked, it.penalised_batch(it.from_unit(np.array(asked))).tolist())

        search.minimise(lambda _, run=evolve: run())
        if (best := search.record.best_x) is None:
            continue
        yield Found(best, f"cma, seed {seed}")
        if (better := slsqp(best)) is not None:
            yield Found(better, f"cma, seed {seed}, then SLSQP")


def _drawn(instance: Instance) -> Iterator[Found]:
    """Evolution on the mean of draws that stay the same."""
    import cma

    problem = instance.problem
    objective = instance.objective()
    draws = np.arange(16)

    def mean(points: np.ndarray) -> np.ndarray:
        X = np.repeat(problem.free.expand(points), len(draws), axis=0)
        values = problem.at_all(X, np.tile(draws, len(points)))[0][:, 0]
        return values.reshape(len(points), -1).mean(axis=1)

    for seed in range(1, SEEDS):
        settings = {"bounds": [0, 1], "seed": seed, "verbose": -9, "popsize": 16, "maxiter": 30}
        strategy = cma.CMAEvolutionStrategy(np.full(objective.n, 0.5), 0.25, settings)
        while not strategy.stop():
            asked = strategy.ask()
            strategy.tell(asked, mean(objective.from_unit(np.array(asked))).tolist())
        best = objective.from_unit(np.asarray(strategy.result.xfavorite))
        yield Found(np.clip(best, *objective.bounds), f"cma on 16 draws, seed {seed}")
