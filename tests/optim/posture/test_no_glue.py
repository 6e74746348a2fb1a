"""Other people's optimisers take a posture problem's plain arrays as they are.

So they do where ends are given, in the view of the angles that are free.
"""

import cma
import numpy as np
import pytest
from scipy.optimize import Bounds, minimize

from tests.optim.posture.helpers import over_bump

pytestmark = pytest.mark.long

CRITERION = "torque_variation"
ENDS = {"start_angles": (1.5, 1.6), "end_angles": (1.6, 1.5)}


@pytest.fixture
def problem():
    """The free view of one with given ends, which has the same functions of plain arrays."""
    return over_bump(CRITERION, **ENDS).free


def middle(problem):
    low, high = problem.bounds
    return (low + high) / 2 + 0.05 * np.sin(np.arange(problem.n))


def assert_better(problem, x, value, feasible=True):
    """The value is the problem's own, and less than at the start; x about feasible if asked."""
    assert value == pytest.approx(problem.objective(x), rel=1e-9)
    assert value < problem.objective(middle(problem))
    assert problem.is_feasible(x, 1e-4) or not feasible


def test_scipy_minimize(problem):
    found = minimize(
        problem.objective,
        middle(problem),
        jac=problem.gradient,
        bounds=Bounds(*problem.bounds),
        constraints={"type": "ineq", "fun": problem.constraints, "jac": problem.jacobian},
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-10},
    )
    assert_better(problem, found.x, found.fun)


def test_cma_ask_and_tell_with_whole_generations(problem):
    options = {"maxfevals": 80, "popsize": 8, "seed": 3, "verbose": -9, "verb_log": 0}
    strategy = cma.CMAEvolutionStrategy(middle(problem), 0.02, options)
    while not strategy.stop():
        asked = strategy.ask()
        strategy.tell(asked, list(problem.objectives(asked)))
    assert_better(problem, strategy.result.xbest, strategy.result.fbest, feasible=False)


def test_pymoo(problem):
    from pymoo.algorithms.soo.nonconvex.ga import GA
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize as pymoo_minimize

    class Posture(Problem):
        def __init__(self):
            low, high = problem.bounds
            m = len(problem.constraints(low))
            super().__init__(n_var=problem.n, n_obj=1, n_ieq_constr=m, xl=low, xu=high)

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = problem.objectives(x)
            out["G"] = np.array([-problem.constraints(one) for one in x])

    random = np.random.default_rng(2)
    begin = middle(problem) + 0.01 * random.standard_normal((8, problem.n))
    found = pymoo_minimize(
        Posture(), GA(pop_size=8, sampling=begin), ("n_gen", 6), seed=1, verbose=False
    )
    assert problem.is_feasible(found.X)
    assert_better(problem, found.X, float(found.F[0]))


def test_nevergrad(problem):
    import nevergrad as ng

    angles = ng.p.Array(init=middle(problem)).set_mutation(sigma=0.02).set_bounds(*problem.bounds)
    angles.random_state.seed(4)
    search = ng.optimizers.OnePlusOne(parametrization=angles, budget=60)
    found = search.minimize(problem.objective)
    assert_better(problem, found.value, problem.objective(found.value), feasible=False)
