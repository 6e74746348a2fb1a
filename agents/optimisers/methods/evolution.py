"""Methods that sample: populations, Parzen estimators, random points."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.optimisers.methods.local import starts
from stickslip.envs.rendering.extras import require
from stickslip.optim.instances.exports import (
    Foreign,
    as_evosax,
    as_nevergrad,
    as_optuna,
    as_pymoo,
    as_scipy_global,
)

if TYPE_CHECKING:
    from stickslip.optim.instances.objective import Objective

POPULATION, OFFSPRING, TOGETHER, POINTS = 32, 64, 64, 40
WIDTH = 0.2
"""First deviation of evolution strategies, in parts of the box."""
MANY = 10**8


def random_search(objective: Objective, seed: int) -> None:
    """Uniform points, TOGETHER at once."""
    rng = np.random.default_rng(seed)
    while True:
        objective.batch_with_constraints(objective.from_unit(rng.random((TOGETHER, objective.n))))


def de(objective: Objective, seed: int) -> None:
    """scipy's differential evolution with POPULATION uniform points to begin with, unpolished."""
    from scipy.optimize import differential_evolution

    rng = np.random.default_rng(seed)
    begin: Foreign = objective.from_unit(rng.random((POPULATION, objective.n)))
    differential_evolution(
        lambda X: objective.penalised_batch(X.T),
        as_scipy_global(objective)["bounds"],
        init=begin,
        rng=rng,
        vectorized=True,
        updating="deferred",
        polish=False,
        maxiter=MANY,
        tol=0,
    )


def evosax_cma_es(objective: Objective, seed: int) -> None:
    """CMA-ES of evosax."""
    _evosax(objective, seed, "CMA_ES")


def evosax_snes(objective: Objective, seed: int) -> None:
    """SNES of evosax."""
    _evosax(objective, seed, "SNES")


def _evosax(objective: Objective, seed: int, name: str) -> None:
    import jax

    algorithms = _library("evosax.algorithms")
    middle, fitness = as_evosax(objective)
    with jax.numpy_dtype_promotion("standard"):
        strategy = getattr(algorithms, name)(population_size=POPULATION, solution=middle)
        params = strategy.default_params.replace(std_init=WIDTH)
        key, first = jax.random.split(jax.random.key(seed))
        begin = objective.to_unit(next(starts(objective, seed)))
        state = strategy.init(first, begin, params)
        while True:
            key, asked, told = jax.random.split(key, 3)
            population, state = strategy.ask(asked, state, params)
            state, _ = strategy.tell(told, population, fitness(population), state, params)


def pymoo_isres(objective: Objective, seed: int) -> None:
    """ISRES of pymoo."""
    algorithm = _library("pymoo.algorithms.soo.nonconvex.isres").ISRES(n_offsprings=OFFSPRING)
    _pymoo(objective, seed, algorithm)


def pymoo_nsga2(objective: Objective, seed: int) -> None:
    """NSGA-II of pymoo, for several goals."""
    _pymoo(objective, seed, _library("pymoo.algorithms.moo.nsga2").NSGA2(pop_size=POINTS))


def _pymoo(objective: Objective, seed: int, algorithm: Foreign) -> None:
    minimize = _library("pymoo.optimize").minimize
    minimize(as_pymoo(objective), algorithm, ("n_gen", MANY), seed=seed + 1)


def nevergrad_de(objective: Objective, seed: int) -> None:
    """nevergrad's TwoPointsDE; its NGOpt (1.0.12) raises TypeError with NumPy 2.4 here."""
    ng = _library("nevergrad")
    where, function = as_nevergrad(objective)
    where.random_state = np.random.RandomState(seed)
    budget = objective.budget or MANY
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its own
        search: Foreign = ng.optimizers.TwoPointsDE(where, budget=budget)
        while True:
            asked = search.ask()
            search.tell(asked, function(asked.value))


def optuna_tpe(objective: Objective, seed: int) -> None:
    """Optuna's TPE, a study of several directions where there are several goals."""
    optuna = _library("optuna")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what is experimental
        study = optuna.create_study(
            sampler=optuna.samplers.TPESampler(seed=seed), directions=["minimize"] * objective.k
        )
        study.optimize(as_optuna(objective), n_trials=None)


def _library(module: str) -> Foreign:
    return require(module, "this method", "optimisers")
