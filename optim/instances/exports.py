"""An Objective as other libraries take it. What a library is not there for is named when asked.

    from scipy.optimize import minimize
    from stickslip.optim.instances.exports import as_scipy

    objective.minimise(lambda it: minimize(**as_scipy(it), method="SLSQP"))

Libraries that take no constraints get `Objective.penalised`, whose value at a feasible point is the
objective's own. A box of sides 1 is scaled by `Objective.from_unit`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.optim.instances.objective import Objective, penalised_values
from stickslip.optim.methods import own_draws

if TYPE_CHECKING:
    from jaxtyping import Float


External: TypeAlias = Any
"""Arguments and results of other libraries."""
SIGMA = 0.2
"""First deviation of evolution strategies, as a part of the box."""


def as_scipy(objective: Objective, x0: Float[np.ndarray, "n"] | None = None) -> dict[str, External]:
    """Arguments of scipy.optimize.minimize (SLSQP, trust-constr, COBYQA, ...), with exact slopes if
    there are any; cyipopt.minimize_ipopt takes them, too. x0: by default the bounds' middle.

    SciPy warns where a method leaves slopes or constraints aside (L-BFGS-B and Nelder-Mead take no
    constraints: they may end at a point that is not feasible, which the record does not keep)."""
    _require_one_goal(objective)
    given: dict[str, External] = {
        "fun": objective,
        "x0": objective.middle if x0 is None else x0,
        "bounds": list(zip(*objective.bounds, strict=True)),
    }
    limit: dict[str, External] = {"type": "ineq", "fun": objective.constraints}
    if objective.has_slopes:
        given["jac"], limit["jac"] = objective.gradient, objective.jacobian
    return given | ({"constraints": limit} if objective.m else {})


def as_scipy_global(objective: Objective) -> dict[str, External]:
    """Arguments of scipy.optimize.differential_evolution, dual_annealing, shgo and direct.

    With vectorized=True, updating="deferred" a generation is one batch."""
    _require_one_goal(objective)
    bounds = list(zip(*objective.bounds, strict=True))
    return {"func": partial(_penalised, objective, np.transpose), "bounds": bounds}


def as_pymoo(objective: Objective) -> External:
    """A pymoo Problem that evaluates whole populations, one or several goals, with constraints."""
    pymoo = require("pymoo.core.problem", "as_pymoo", "optimisers")
    low, high = map(np.array, objective.bounds)

    class Exported(pymoo.Problem):
        """The objective."""

        def __reduce__(self) -> tuple[External, ...]:
            return as_pymoo, (objective,)

        def __deepcopy__(self, memo: External) -> External:
            return self  # what pymoo's copies evaluate counts, too

        def _evaluate(
            self, x: External, out: dict[str, External], *_: External, **__: External
        ) -> None:
            values, margins = objective.batch_with_constraints(x)
            out["F"] = np.reshape(values, (len(x), objective.k))
            if objective.m:
                out["G"] = -margins

    sizes = {"n_var": objective.n, "n_obj": objective.k, "n_ieq_constr": objective.m}
    return Exported(**sizes, xl=low, xu=high)


def as_cma(objective: Objective, seed: int = 1) -> dict[str, External]:
    """Arguments of cma.fmin2, in a box of sides 1, with `own_draws` of the seed."""
    seed = require_integer("seed", seed, low=0, high=2**64)
    return {
        "objective_function": _in_unit_box(objective),
        "x0": np.full(objective.n, 0.5),
        "sigma0": SIGMA,
        "options": {"bounds": [0, 1], **own_draws(seed), "verbose": -9},
    }


def as_nevergrad(objective: Objective) -> tuple[External, Callable[[External], float]]:
    """A parametrisation and a function: `Optimizer(parametrization, budget).minimize(function)`."""
    _require_one_goal(objective)
    low, high = objective.bounds
    array = require("nevergrad", "as_nevergrad", "optimisers").p.Array
    return array(init=objective.middle, lower=low, upper=high), objective.penalised


def as_optuna(objective: Objective) -> Callable[[External], External]:
    """A function of a trial: `study.optimize(function, n_trials)`; a study of several directions
    where there are several goals."""

    def of_trial(trial: External) -> External:
        numbers = enumerate(zip(*objective.bounds, strict=True))
        x = np.array([trial.suggest_float(f"x{i}", low, high) for i, (low, high) in numbers])
        if objective.k == 1:
            return objective.penalised(x)
        values, margins = np.asarray(objective(x)), objective.constraints(x)
        return tuple(penalised_values(values, margins).tolist())

    return of_trial


def as_evosax(objective: Objective) -> tuple[np.ndarray, Callable[[External], np.ndarray]]:
    """A first solution, and the fitness of a population [B, n] as `tell` takes it, in a box of
    sides 1: strategies begin with a deviation of 1, so give them params.replace(std_init=0.2)."""
    return np.full(objective.n, 0.5), _in_unit_box(objective)


def as_ioh(objective: Objective, name: str) -> External:
    """A problem of IOHexperimenter, to which its loggers can be attached; x in a box of sides 1."""
    function, size = _in_unit_box(objective), objective.n
    wrap = require("ioh", "as_ioh", "").wrap_problem
    return wrap(function, name=name, dimension=size, lb=0.0, ub=1.0)


def _in_unit_box(objective: Objective) -> Callable[[External], External]:
    """The penalised value of a point, or values of rows, in a box of sides 1."""
    _require_one_goal(objective)
    return partial(_penalised, objective, objective.from_unit)


def _penalised(
    objective: Objective, moved: Callable[[External], np.ndarray], x: Float[np.ndarray, "..."]
) -> External:
    """The penalised value of a point, or of each row, that `moved` makes the objective's."""
    x = moved(x)
    return objective.penalised(x) if np.ndim(x) == 1 else objective.penalised_batch(x)


def _require_one_goal(objective: Objective) -> None:
    if objective.k > 1:
        raise ValueError(f"{objective.k} goals; accepted: one (pymoo and optuna take several)")
