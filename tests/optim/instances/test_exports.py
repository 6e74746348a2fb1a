"""Each library takes an objective in a line, and finds what is on paper."""

import numpy as np
import pytest

from stickslip.optim import instance
from stickslip.optim.instances import exports
from tests.optim.instances.toys import LEAST, toy


def test_scipy_with_slopes():
    from scipy.optimize import minimize

    it = toy().objective(budget=100)
    record = it.minimise(lambda o: minimize(**exports.as_scipy(o, [-1.0, -1.0]), method="SLSQP"))
    assert record.best == pytest.approx(LEAST, abs=1e-6)
    assert record.gradients > 0
    assert record.evaluations < 30


def test_pymoo_in_batches_and_with_several_goals():
    pytest.importorskip("pymoo")
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.optimize import minimize

    one, two = toy().objective(budget=1000), toy(goals=2).objective(budget=800)
    record = one.minimise(lambda o: minimize(exports.as_pymoo(o), DE(pop_size=20), seed=1))
    assert record.best == pytest.approx(LEAST, abs=1e-2)
    assert record.batches == 50
    record = two.minimise(lambda o: minimize(exports.as_pymoo(o), NSGA2(pop_size=40), seed=1))
    front = np.array([values for _, values in record.front])
    assert len(front) > 20
    assert front.min(axis=0) == pytest.approx([LEAST, 0.0], abs=0.04)


def test_cma_draws_of_its_seed_alone():
    cma = pytest.importorskip("cma")
    record = toy().objective(budget=400).minimise(lambda o: cma.fmin2(**exports.as_cma(o)))
    assert record.best == pytest.approx(LEAST, abs=1e-2)
    before = np.random.get_state()[1].copy()  # noqa: NPY002

    def run(seed):
        it = toy().objective(budget=20)
        return it.minimise(lambda o: cma.fmin2(**exports.as_cma(o, seed=seed))).best_x

    assert np.array_equal(run(0), run(0))  # which cma by itself takes for the time of day
    assert not np.array_equal(run(0), run(2))
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_differential_evolution_in_batches():
    from scipy.optimize import differential_evolution

    def run(**options):
        it = toy().objective()
        given = {"rng": 0, "maxiter": 3, "updating": "deferred", "polish": False, **options}
        return it.minimise(lambda o: differential_evolution(**exports.as_scipy_global(o), **given))

    many, one = run(vectorized=True), run()
    assert many.batches == 4
    assert many.values == one.values
    assert many.best == pytest.approx(one.best, abs=1e-9)
    whole = toy().objective(budget=3000)
    whole.minimise(lambda o: differential_evolution(**exports.as_scipy_global(o)))
    assert whole.record.best == pytest.approx(LEAST, abs=1e-2)


def test_ioh():
    pytest.importorskip("ioh")
    it = toy().objective()
    problem = exports.as_ioh(it, "toy")
    assert problem([0.625, 0.375]) == pytest.approx(0.5)
    assert it.record.values == problem.state.evaluations == 1


def test_cvxpy_takes_what_is_convex():
    one = instance("gait-time-d16-v2")
    program, found = one.problem.in_cvxpy()
    program.solve(solver="CLARABEL")
    values, feasible = one.value(found())
    assert feasible
    assert values[0] == pytest.approx(one.best_known, rel=1e-6)


def test_optuna_gets_the_values_of_a_point_that_nearly_keeps_the_limits():
    class Trial:
        def suggest_float(self, name, low, high):
            return 0.25 + 2e-7

    values = exports.as_optuna(toy(goals=2).objective())(Trial())
    assert values == tuple(toy(goals=2).objective()([0.25 + 2e-7] * 2))


def test_several_goals_are_refused_where_one_is_taken():
    for export in (exports.as_scipy, exports.as_cma, exports.as_evosax):
        with pytest.raises(ValueError, match="2 goals; accepted: one"):
            export(toy(goals=2).objective())


def test_a_library_that_is_not_there_is_named(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "ioh", None)
    with pytest.raises(ModuleNotFoundError, match=r'as_ioh needs ioh, .*pip install "ioh"'):
        exports.as_ioh(toy().objective(), "toy")
    monkeypatch.setitem(sys.modules, "pymoo.core.problem", None)
    with pytest.raises(ModuleNotFoundError, match=r"needs pymoo, .*stickslip\[optimisers\]"):
        exports.as_pymoo(toy().objective())
