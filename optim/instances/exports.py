"""An Objective as other libraries take it. What a library is not there for is named when asked.

    from scipy.optimize import minimize
    from stickslip.optim.instances.exports import as_scipy

    objective.minimise(lambda it: minimize(**as_scipy(it), method="SLSQP"))

Libraries that take no constraints get `Objective.penalised`, whose value at a feasible point is the
objective's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.optim.instances.objective import PENALTY, Objective
from stickslip.optim.methods import own_draws

if TYPE_CHECKING:
    from collections.abc import Callable

    from jaxtyping import Float

    from stickslip.optim.instances.instance import Instance

External: TypeAlias = Any
"""Arguments and results of other libraries."""


@dataclass(frozen=True)
class Penalised:
    """`Objective.penalised` as a function of one point, which processes can be handed.

    in_unit_box: points lie in a box of sides 1. SciPy's vectorised points are columns [n, B]."""

    objective: Objective
    weight: float
    in_unit_box: bool = False

    def __call__(self, x: Float[np.ndarray, "n"] | Float[np.ndarray, "n B"]) -> External:
        """The value, or values [B]."""
        if np.ndim(x) == 2:
            return self.of_rows(np.transpose(x))
        return self.objective.penalised(self._point(x), self.weight)

    def of_rows(self, X: Float[np.ndarray, "B n"]) -> Float[np.ndarray, "B"]:
        """The values of points that are rows."""
        return self.objective.penalised_batch(self._point(X), self.weight)

    def _point(self, x: External) -> External:
        return self.objective.from_unit(x) if self.in_unit_box else x


@dataclass(frozen=True)
class Trial:
    """An objective as a function of Optuna's trials."""

    objective: Objective
    weight: float

    def __call__(self, trial: External) -> External:
        """The value, or the values of several goals."""
        numbers = enumerate(zip(*self.objective.bounds, strict=True))
        x = np.array([trial.suggest_float(f"x{i}", low, high) for i, (low, high) in numbers])
        if self.objective.k == 1:
            return self.objective.penalised(x, self.weight)
        values, missed = self.objective(x), self.objective.violation(x)
        return tuple(float(value + self.weight * missed) for value in values)


def as_scipy(objective: Objective, x0: Float[np.ndarray, "n"] | None = None) -> dict[str, External]:
    """Arguments of scipy.optimize.minimize (SLSQP, trust-constr, COBYQA, ...), with exact slopes
    where the instance has them; cyipopt.minimize_ipopt takes them, too. x0: the middle of the
    bounds unless given.

    SciPy warns where a method leaves slopes or constraints aside (L-BFGS-B and Nelder-Mead take no
    constraints: they may end at a point that is not feasible, which the record does not keep)."""
    _require_one_goal(objective)
    slopes = objective.has_slopes
    given: dict[str, External] = {
        "fun": objective,
        "x0": objective.middle if x0 is None else x0,
        "bounds": list(zip(*objective.bounds, strict=True)),
    }
    if slopes:
        given["jac"] = objective.gradient
    if objective.m:
        limit: dict[str, External] = {"type": "ineq", "fun": objective.constraints}
        given["constraints"] = limit | ({"jac": objective.jacobian} if slopes else {})
    return given


def as_scipy_global(objective: Objective, penalty: float = PENALTY) -> dict[str, External]:
    """Arguments of scipy.optimize.differential_evolution, dual_annealing, shgo and direct.

    differential_evolution may be given vectorized=True, updating="deferred": a generation is then
    one batch; or workers: the map of a pool whose processes are spawned."""
    _require_one_goal(objective)
    return {
        "func": Penalised(objective, penalty),
        "bounds": list(zip(*objective.bounds, strict=True)),
    }


def as_pymoo(objective: Objective) -> External:
    """A pymoo Problem that evaluates whole populations, one or several goals, with constraints."""
    pymoo = _library("pymoo.core.problem", "pymoo")
    low, high = map(np.array, objective.bounds)

    class Exported(pymoo.Problem):
        """The objective."""

        def __reduce__(self) -> tuple[External, ...]:
            return as_pymoo, (objective,)

        def __deepcopy__(self, memo: External) -> External:
            return self  # what pymoo's copies evaluate counts, too

        def __init__(self):
            super().__init__(
                n_var=objective.n, n_obj=objective.k, n_ieq_constr=objective.m, xl=low, xu=high
            )

        def _evaluate(
            self, x: External, out: dict[str, External], *_: External, **__: External
        ) -> None:
            values, margins = objective.batch_with_constraints(x)
            out["F"] = np.reshape(values, (len(x), objective.k))
            if objective.m:
                out["G"] = -margins

    return Exported()


def as_cma(
    objective: Objective, sigma: float = 0.2, seed: int = 1, penalty: float = PENALTY
) -> dict[str, External]:
    """Arguments of cma.fmin2, in a box of sides 1; `Objective.from_unit` leads back.

    The draws are of `seed` alone, 0 too, which cma by itself takes for the time of day; NumPy's
    global state stays as it is."""
    _require_one_goal(objective)
    seed = require_integer("seed", seed, low=0, high=2**64)
    return {
        "objective_function": Penalised(objective, penalty, in_unit_box=True),
        "x0": np.full(objective.n, 0.5),
        "sigma0": sigma,
        "options": {"bounds": [0, 1], **own_draws(seed), "verbose": -9},
    }


def as_nevergrad(
    objective: Objective, penalty: float = PENALTY
) -> tuple[External, Callable[[External], float]]:
    """A parametrisation and a function: `Optimizer(parametrization, budget).minimize(function)`."""
    _require_one_goal(objective)
    ng = _library("nevergrad", "nevergrad")
    low, high = objective.bounds
    where = ng.p.Array(init=objective.middle, lower=low, upper=high)
    return where, Penalised(objective, penalty)


def as_optuna(objective: Objective, penalty: float = PENALTY) -> Callable[[External], External]:
    """A function of a trial: `study.optimize(function, n_trials)`; a study of several directions
    where there are several goals."""
    return Trial(objective, penalty)


def as_evosax(
    objective: Objective, penalty: float = PENALTY
) -> tuple[np.ndarray, Callable[[External], np.ndarray]]:
    """A first solution, and the fitness of a population [B, n] as `tell` takes it, in a box of
    sides 1: strategies begin with a deviation of 1, so give them params.replace(std_init=0.2)."""
    _require_one_goal(objective)
    return np.full(objective.n, 0.5), Penalised(objective, penalty, in_unit_box=True).of_rows


def as_ioh(objective: Objective, name: str, penalty: float = PENALTY) -> External:
    """A problem of IOHexperimenter, to which its loggers can be attached; x in a box of sides 1."""
    _require_one_goal(objective)
    ioh = _library("ioh", "ioh")
    return ioh.wrap_problem(
        Penalised(objective, penalty, in_unit_box=True),
        name=name,
        dimension=objective.n,
        lb=0.0,
        ub=1.0,
    )


def as_cvxpy(instance: Instance) -> tuple[External, Callable[[], Float[np.ndarray, "n"]]]:
    """A cvxpy Problem of a convex instance, and a function for its free numbers once solved.

    Nothing is counted: cvxpy never asks for a value. ValueError for an instance that is not convex.
    """
    if not instance.flags.convex or len(instance.goals) > 1:
        raise ValueError(f"{instance.id} is not convex with one goal; accepted: one that is")
    return instance.problem.in_cvxpy()


def _require_one_goal(objective: Objective) -> None:
    if objective.k > 1:
        raise ValueError(f"{objective.k} goals; accepted: one (pymoo and optuna take several)")


def _library(module: str, name: str) -> External:
    """A library that is an extra."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"{name} is not there ({error}); the extra stickslip[optimisers] has all of these "
            "libraries but ioh and cyipopt"
        ) from error
