"""An instance of the suite in the hands of other libraries, 20 evaluations each."""

import sys

import cma
import jax
import nevergrad
import optuna
from evosax.algorithms import CMA_ES  # noqa: F401  (as_evosax needs it to be there)
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.optimize import minimize
from scipy.optimize import minimize as scipy_minimize

from stickslip.optim import instance
from stickslip.optim.instances import exports

optuna.logging.set_verbosity(optuna.logging.WARNING)


def by_nevergrad(it):
    """One line of docs/suite.md."""
    where, function = exports.as_nevergrad(it)
    nevergrad.optimizers.OnePlusOne(where, budget=20).minimize(function)


def by_evosax(it):
    """Its values of a few points at once."""
    first, fitness = exports.as_evosax(it)
    fitness(jax.numpy.stack([first, first]))


LIBRARIES = {
    "scipy": lambda it: scipy_minimize(**exports.as_scipy(it), method="SLSQP"),
    "pymoo": lambda it: minimize(exports.as_pymoo(it), DE(pop_size=10), ("n_gen", 2)),
    "cma": lambda it: cma.fmin2(**exports.as_cma(it)),
    "nevergrad": by_nevergrad,
    "optuna": lambda it: optuna.create_study().optimize(exports.as_optuna(it), n_trials=20),
    "evosax": by_evosax,
}
for name, search in LIBRARIES.items():
    objective = instance("ugv-bump-energy-d8-v2").objective(budget=20)
    record = objective.minimise(search)
    if not record.evaluations:
        sys.exit(f"{name} evaluated nothing")
    print(name, record.evaluations, record.best)
