"""Instances in other processes give the same numbers; objectives count in their own alone."""

import copy
import multiprocessing
import pickle

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.optim import FAMILIES, FunctionProblem, instance, suite
from tests.optim.instances.toys import HIGH, LOW, toy

SMALLEST = {one: min(suite(one).values(), key=lambda it: it.n).id for one in FAMILIES}
QUICK = SMALLEST["posture"]
X = np.array([0.5, -0.5])


def scaled(data, x, draw):
    return data["kept"] * x, x


def everything(one, slopes: bool = True) -> list[np.ndarray]:
    """What is known of a point that was not looked at before."""
    objective = one.objective()
    x = objective.middle + 1e-3 * (objective.bounds[1] - objective.bounds[0])
    found = [objective(x), objective.constraints(x)]
    if slopes:
        found += [*objective.batch([x, objective.middle]), objective.violation(x)]
    if slopes and objective.has_slopes:
        found += [objective.gradient(x), objective.jacobian(x)]
    return [np.array(one) for one in found]


@pytest.mark.parametrize(
    ("name", "slopes"),
    [
        (QUICK, False),
        *(pytest.param(one, True, marks=pytest.mark.long) for one in SMALLEST.values()),
    ],
)
def test_an_evaluated_instance_is_the_same_to_the_last_bit_in_another_process(name, slopes):
    one = instance(name)
    here = everything(one, slopes)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        others = [pool.apply(everything, (one, slopes))]
    others += [everything(again, slopes) for again in (copy.copy(one), copy.deepcopy(one))]
    for other in others:
        for a, b in zip(here, other, strict=True):
            np.testing.assert_array_equal(b, a)
            assert b.dtype == np.float64


def test_what_a_copy_was_given_is_in_the_precision_that_it_was_given_in():
    with jax.enable_x64(True):
        data = {"kept": jnp.arange(3.0) / 3, "key": jax.random.key(0), "rest": 0.1}
    problem = FunctionProblem(scaled, data, LOW, HIGH)
    again = pickle.loads(pickle.dumps(problem))
    kept = again.data["kept"]
    assert (type(kept), kept.dtype, again.data["rest"]) == (np.ndarray, np.float64, 0.1)
    np.testing.assert_array_equal(kept, np.asarray(data["kept"]))
    assert again.data["key"] == data["key"]


def test_an_objective_whose_copies_would_count_elsewhere_is_not_copied():
    with pytest.raises(TypeError, match="in one process; accepted: an Instance"):
        pickle.dumps(toy().objective())


@pytest.mark.filterwarnings("ignore:os.fork.. was called")
@pytest.mark.filterwarnings("ignore:This process .* is multi-threaded")
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork")
def test_a_fork_is_refused_where_it_would_wait_for_ever():
    posture, gait = instance(QUICK).problem, instance(SMALLEST["gait"])
    toy().objective()(X)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        for evaluate in (posture.objective, gait.value):
            with pytest.raises(RuntimeError, match=r"accepted: processes that are spawned"):
                pool.map_async(evaluate, [X / 2]).get(60)
