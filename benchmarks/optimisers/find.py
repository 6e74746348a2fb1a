"""The best feasible point that can be found for an instance, by what suits its family."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize

from stickslip.dynamics.biped import BipedState, RK4Split, simulate
from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import FunctionProblem, Instance, Objective, PostureProblem, solve
from stickslip.optim.instances.biped.gait import Interpolated
from stickslip.optim.instances.biped.shooting import DT, HELD, TORQUE_LIMIT, Shooting
from stickslip.optim.instances.exports import as_cvxpy, as_scipy
from stickslip.optim.instances.ugv.split import drive_family
from stickslip.optim.posture.graph.pareto import pareto_front
from stickslip.optim.problem import FEASIBLE
from stickslip.optim.torque_split import TorqueSplit

SEEDS = 3
EVALUATIONS = 6000
CLARABEL = "cvxpy with Clarabel"
WIDTHS = (0.01, 0.05, 0.2)
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
        "shooting": _shooting,
        "gains": _drawn,
        "design": _design,
    }[instance.family](instance)


def front_for(instance: Instance) -> tuple[np.ndarray, str]:
    """Free numbers [points, n] of a front, and how they were found."""
    problem = instance.problem
    if isinstance(problem, Interpolated):
        rows = []
        for share in SHARES:
            weights = {"time": float(share), "energy": float(1 - share)}
            rows.append(_solved(problem, objective_asked=weights))
        return np.array(rows), f"{CLARABEL}, {len(SHARES)} weights"
    if not isinstance(problem, PostureProblem):
        raise TypeError(f"{instance.id} is of no kind that fronts are found for")
    first, second = (goal.split()[0] for goal in instance.goals)
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
    yield Found(within, CLARABEL, proved, "dual of each station")
    each = np.clip([one.difference / float(params.weight) for one in splits], -1, 1)
    yield Found(each, "each station by itself", proved, "dual of each station")


def _gait(instance: Instance) -> Iterator[Found]:
    problem = instance.problem
    restricted = isinstance(problem, Interpolated)
    whole = solve(problem.fine if restricted else problem, "conic")
    why = f"dual, of gaits of {whole.details['cells']} cells a step, limits kept at the nodes"
    if whole.x is None:
        return
    if not restricted:
        yield Found(whole.x, "conic", whole.lower_bound, why)
        return
    x = _least_friction(problem) if problem.fine.goal.is_friction else _solved(problem)
    if x is None:
        return
    yield Found(x, CLARABEL, whole.lower_bound, why)


def _solved(problem: Interpolated, **changes: Any) -> np.ndarray | None:
    """The best decision vector of the problem with other fields; None where there is none."""
    changed = replace(problem, fine=replace(problem.fine, **changes))
    program, found = changed.in_cvxpy()
    program.solve(solver="CLARABEL")
    return np.clip(found(), *changed.bounds) if program.status == "optimal" else None


def _least_friction(problem: Interpolated) -> np.ndarray:
    """Bisection on the friction coefficient that a gait keeps to."""
    low, high, best = 0.0, 1.0, None
    while high - low > 1e-7 * high:
        middle = (low + high) / 2
        x = _solved(problem, objective_asked="torque", mu=middle)
        if x is not None and problem.is_feasible(x, FEASIBLE / 2) and problem.objective(x) < high:
            best, high = x, problem.objective(x)
        else:
            low = middle
    if best is None:
        raise ValueError("no gait keeps to a friction of 1; accepted: a problem with one")
    return best


def _shooting(instance: Instance) -> Iterator[Found]:
    """From the torques of simple feedbacks: the best of them, evolved and polished."""
    problem = instance.problem
    if not isinstance(problem, FunctionProblem) or not isinstance(problem.function, Shooting):
        raise TypeError(f"{instance.id} is no shooting")
    model, scene, state = problem.data
    rate, integrator = problem.function.crank_rate, problem.function.integrator or RK4Split()

    def fed_back(gain: jax.Array, rest: jax.Array) -> jax.Array:
        def torque(at: BipedState) -> jax.Array:
            return jnp.clip(gain * (rate - at.crank_rate) + rest, -TORQUE_LIMIT, TORQUE_LIMIT)

        time = problem.n * HELD * DT
        return simulate(model, scene, state, torque, time, DT, integrator=integrator).torques

    with jax.enable_x64(True):
        each = jnp.meshgrid(jnp.array([0.1, 0.3, 1.0, 2.0]), jnp.array([0.0, 0.1, 0.2, 0.4]))
        torques = jax.jit(jax.vmap(fed_back))(*(one.ravel() for one in each))
    starts = np.asarray(torques, float).reshape(len(torques), -1, HELD).mean(axis=-1)
    best = starts[np.argmin(problem.objectives(starts))]
    yield from _evolved(instance, best, f"the best of {len(starts)} feedbacks")


def _design(instance: Instance) -> Iterator[Found]:
    """From the reference, and from a little beside it."""
    middle = instance.objective().middle
    yield from _evolved(instance, middle, "the reference")
    rng = np.random.default_rng(0)
    for _ in range(SEEDS):
        beside = middle * (1 + 0.002 * rng.standard_normal(instance.n))
        if (better := _slsqp(instance, beside)) is not None:
            yield Found(better, "SLSQP from beside the reference")


def _evolved(instance: Instance, start: np.ndarray, words: str) -> Iterator[Found]:
    """Evolution from there with several widths, each followed by SLSQP."""
    import cma

    if instance.objective().violation(start) <= 0:
        yield Found(start, words)
    best, judge = start, instance.objective()
    for seed, sigma in enumerate(WIDTHS, start=1):
        search = instance.objective(budget=EVALUATIONS)

        def evolve(it: Objective, seed: int = seed, sigma: float = sigma) -> None:
            settings = {"bounds": [0, 1], "seed": seed, "verbose": -9, "popsize": 32}
            strategy = cma.CMAEvolutionStrategy(it.to_unit(start), sigma, settings)
            while not strategy.stop():
                asked = strategy.ask()
                strategy.tell(asked, it.penalised_batch(it.from_unit(np.array(asked))).tolist())

        found = search.minimise(evolve).best_x
        if found is not None:
            yield Found(found, f"{words}, cma")
            best = min(best, found, key=judge.penalised)
    if (better := _slsqp(instance, best)) is not None:
        yield Found(better, f"{words}, cma, SLSQP")


def _slsqp(instance: Instance, x: np.ndarray) -> np.ndarray | None:
    """The best feasible point on SLSQP's way from there."""
    polish = instance.objective(budget=600)
    return polish.minimise(
        lambda it: minimize(**as_scipy(it, x), method="SLSQP", options={"maxiter": 200})
    ).best_x


def _drawn(instance: Instance) -> Iterator[Found]:
    """Evolution on the mean of draws that stay the same."""
    import cma

    problem = instance.problem
    if not isinstance(problem, FunctionProblem):
        raise TypeError(f"{instance.id} draws nothing")
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
