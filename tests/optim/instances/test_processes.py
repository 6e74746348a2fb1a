"""Objectives in other processes: the same numbers, and one record of all evaluations."""

import copy
import multiprocessing
import pickle

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.optim import FAMILIES, BudgetSpent, FunctionProblem, instance, suite
from stickslip.optim.instances import exports
from stickslip.optim.instances.objective import Objective
from tests.optim.instances.toys import HIGH, LEAST, LOW, bowl

SMALLEST = {one: min(suite(one).values(), key=lambda it: it.n).id for one in FAMILIES}
QUICK = SMALLEST["posture"]
X = np.array([0.5, -0.5])


def scaled(data, x, draw):
    return data["kept"] * x, x


def toy(data=0.0, **options) -> Objective:
    """An objective that can be pickled."""
    return Objective((FunctionProblem(bowl, data, LOW, HIGH),), **options)


def everything(objective: Objective, slopes: bool = True) -> list[np.ndarray]:
    """What is known of a point that was not looked at before."""
    x = objective.middle + 1e-3 * (objective.bounds[1] - objective.bounds[0])
    found = [objective(x), objective.constraints(x)]
    if slopes:
        found += [*objective.batch([x, objective.middle]), objective.violation(x)]
    if slopes and objective.has_slopes:
        found += [objective.gradient(x), objective.jacobian(x)]
    return [np.array(one) for one in found]


@pytest.fixture(scope="module")
def spawned():
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        yield pool


@pytest.mark.parametrize(
    ("name", "slopes"),
    [
        (QUICK, False),
        *(pytest.param(one, True, marks=pytest.mark.long) for one in SMALLEST.values()),
    ],
)
def test_an_evaluated_instance_is_the_same_to_the_last_bit_in_another_process(
    name, slopes, spawned
):
    one = instance(name)
    here = everything(one.objective(), slopes)
    others = [spawned.apply(everything, (one.objective(), slopes))]
    others += [everything(copies(one.objective()), slopes) for copies in (copy.copy, copy.deepcopy)]
    again = pickle.loads(pickle.dumps(one))
    others.append(everything(again.objective(), slopes))
    for other in others:
        for a, b in zip(here, other, strict=True):
            np.testing.assert_array_equal(b, a)
            assert b.dtype == np.float64


def test_what_a_copy_was_given_is_in_the_precision_that_it_was_given_in():
    with jax.enable_x64(True):
        data = {"kept": jnp.arange(3.0) / 3, "key": jax.random.key(0), "rest": 0.1}
    problem = FunctionProblem(scaled, data, LOW, HIGH)
    for again in (pickle.loads(pickle.dumps(problem)), copy.deepcopy(problem)):
        kept = again.data["kept"]
        assert (type(kept), kept.dtype, again.data["rest"]) == (np.ndarray, np.float64, 0.1)
        np.testing.assert_array_equal(kept, np.asarray(data["kept"]))
        assert again.data["key"] == data["key"]


def test_what_workers_evaluate_is_counted_at_home(spawned):
    from scipy.optimize import differential_evolution

    def run(**options):
        it = toy(targets=(1.0, 0.2))
        given = {"rng": 0, "maxiter": 3, "updating": "deferred", "polish": False, **options}
        record = it.minimise(
            lambda o: differential_evolution(**exports.as_scipy_global(o), **given)
        )
        return it, record

    (it, away), (_, home) = run(workers=spawned.map), run()
    assert away.values == home.values > 30
    assert (away.best, away.best_x.tolist()) == (home.best, home.best_x.tolist())
    assert away.best - LEAST < 0.2
    assert set(away.hits) == set(home.hits)
    points = [X, X + 0.25, [9.0, 0.0]]
    spawned.map(it.batch, [points[:1], points[1:]])
    spawned.map(it.value_and_grad, points)
    assert (away.values, away.gradients, away.clipped) == (home.values + 6, 3, 3)
    assert away.batches == 2


def test_a_budget_ends_in_workers_too(spawned):
    it = toy(budget=4)
    record = it.minimise(lambda o: [spawned.map(o, [[0.1 * i, 0.0]]) for i in range(9)])
    assert (record.values, record.best) == (4, pytest.approx(0.49))
    with pytest.raises(BudgetSpent, match="4 evaluations"):
        spawned.apply(it, (X,))


def test_draws_elsewhere_differ_from_point_to_point(spawned):
    noisy = Objective((FunctionProblem(bowl, 0.1, LOW, HIGH),), noisy=True)
    values = spawned.map(noisy, [X, X + 1e-9, X + 2e-9], chunksize=1)
    assert len({round(value - 0.5, 6) for value in values}) == 3


@pytest.mark.filterwarnings("ignore:os.fork.. was called")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork")
def test_a_fork_is_refused_where_it_would_wait_for_ever():
    it, posture, gait = toy(), instance(QUICK).problem, instance(SMALLEST["gait"])
    it(X)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        for evaluate in (it, posture.objective, gait.value):
            with pytest.raises(RuntimeError, match=r"accepted: processes that are spawned"):
                pool.map_async(evaluate, [X / 2]).get(60)


def test_exports_can_be_pickled():
    it = toy()
    for given in (exports.as_scipy(it), exports.as_scipy_global(it), exports.as_cma(it)):
        pickle.dumps(given)
    pickle.dumps((exports.as_optuna(it), exports.as_evosax(it), instance(QUICK)))
    pymoo = pytest.importorskip("pymoo.core.problem")
    again = pickle.loads(pickle.dumps(exports.as_pymoo(it)))
    assert isinstance(again, pymoo.Problem)
    pytest.importorskip("nevergrad")
    pickle.dumps(exports.as_nevergrad(it)[1])
