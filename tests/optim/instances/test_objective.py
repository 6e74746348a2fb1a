"""An objective counts, keeps the best, ends at its budget, and is the same for all who ask."""

import os
import pickle
import time

import numpy as np
import pytest

from stickslip.optim import BudgetSpent, Objective, instance
from stickslip.optim.instances.objective import PENALTY
from tests.optim.instances.toys import LEAST, toy

X = np.array([0.5, -0.5])


def test_it_is_the_problem_in_its_free_numbers():
    it = toy().objective()
    assert (it.n, it.m, it.k) == (2, 1, 1)
    assert [side.tolist() for side in it.bounds] == [[-2, -2], [2, 2]]
    assert it(X) == pytest.approx(0.5)
    assert it.constraints(X) == pytest.approx([0.5])
    assert it.value_and_grad(X)[1] == pytest.approx([-1, -1])
    assert it.jacobian(X) == pytest.approx(np.array([[-1, -1]]))
    assert it.batch([X, X + 1]) == pytest.approx([0.5, 0.5])
    assert it.expand(X).tolist() == [0.5, -0.5, 0.5]
    assert it.from_unit(it.to_unit(X)) == pytest.approx(X)


def test_every_value_asked_for_counts_and_constraints_of_the_same_point_do_not():
    it = toy().objective()
    it.constraints(X), it(X), it.violation(X)
    assert (it.record.values, it.record.repeated) == (1, 0)
    it(X), it.penalised(X)
    assert (it.record.values, it.record.gradients, it.record.repeated) == (3, 0, 2)
    it.gradient(X)
    it.batch(np.zeros((5, 2)))
    record = it.record
    assert (record.values, record.gradients, record.batches) == (8, 1, 1)
    assert record.evaluations == 9


@pytest.mark.parametrize("ask", [lambda it, X: [it(x) for x in X], lambda it, X: it.batch(X)])
def test_the_best_is_feasible_and_improvements_fall(ask):
    it = toy().objective()
    ask(it, [[1.0, 0.0], [0.0, 0.0], [-1.0, 0.0], [0.5, -0.1], [0.75, -0.25]])
    values = [one.value for one in it.record.improvements]
    assert values == pytest.approx([1.0, 0.26, LEAST])  # (1, 0) is not feasible
    assert [one.evaluations for one in it.record.improvements] == [2, 4, 5]
    assert it.record.best_x.tolist() == [0.75, -0.25]


def test_a_budget_ends_and_what_was_found_stays():
    it = toy().objective(budget=3)
    record = it.minimise(lambda objective: [objective([0.1 * i, 0.0]) for i in range(9)])
    assert record.evaluations == 3
    assert record.best == pytest.approx(0.64)
    it = toy().objective(budget=3)
    with pytest.raises(BudgetSpent):
        it.batch(np.array([[0.1 * i, 0.0] for i in range(9)]))
    assert (it.record.values, it.record.best) == (3, pytest.approx(0.64))
    again = toy().objective(budget=2)
    again(X), again(X), again.constraints(X)
    with pytest.raises(BudgetSpent):
        again(X)
    late = toy().objective(seconds=0.01)
    late(X)
    time.sleep(0.02)
    with pytest.raises(BudgetSpent, match="1 evaluations"):
        late(X + 1)


def test_what_is_out_of_bounds_or_no_number_is_counted():
    it = toy().objective()
    assert it([3.0, 0.0]) == it([2.0, 0.0])
    assert it([np.nan, 0.0]) == np.inf
    assert it.batch([[9.0, 9.0], [np.inf, 0.0]]).tolist() == [it([2.0, 2.0]), np.inf]
    assert (it.record.clipped, it.record.not_numbers) == (2, 2)
    it([np.nan, 0.0])
    spent = it.record.values
    assert it.constraints([np.nan, 0.0]).tolist() == [-np.inf]
    assert it.record.values == spent


@pytest.mark.parametrize(
    "options", [{"budget": 0}, {"seconds": 0.0}, {"seconds": np.nan}, {"seed": -1}, {"sed": 1}]
)
def test_options_that_will_not_do_are_named(options):
    with pytest.raises(ValueError, match=next(iter(options))):
        toy().objective(**options)
    for problems in (toy().problem, ()):
        with pytest.raises(ValueError, match=r"problems = .*accepted: a tuple of problems"):
            Objective(problems)
    with pytest.raises(ValueError, match=r"x has shape \(3,\); accepted: \(2,\)"):
        toy().objective()([1.0, 2.0, 3.0])


def test_penalties_leave_feasible_points_alone():
    it = toy().objective()
    points = np.array([X, [1.0, 0.5]])
    assert it.penalised(X) == it(X)
    assert it.penalised_batch(points) == pytest.approx([0.5, 0.25 + PENALTY])
    assert it.penalised(points[1]) == pytest.approx(0.25 + PENALTY)
    assert it.penalised([np.nan, 0.0]) == it.penalised_batch([[np.nan, 0.0]])[0] == np.inf
    nearly = np.array([0.5, 5e-7])  # missed by less than is let pass
    assert it.penalised(nearly) == it(nearly)
    several = toy(goals=2).objective()
    assert several.penalised_batch(points) == pytest.approx(list(map(several.penalised, points)))


@pytest.mark.parametrize("name", ["gait-time-d16-v2", "gait-friction-d32-v2"])
def test_penalties_lead_on_where_a_gait_has_no_value(name):
    it, rng = instance(name).objective(), np.random.default_rng(0)
    points = it.from_unit(rng.random((40, it.n)))
    assert np.isfinite(it.penalised(np.zeros(it.n)))  # standing still
    none = points[np.isinf(it.batch(points))]
    assert len(none)
    nearer = none + 1e-6 * (it.bounds[1] - it.bounds[0])
    found, moved = it.penalised_batch(none), it.penalised_batch(nearer)
    assert np.all(np.isfinite(found))
    assert np.all((found != moved) & (abs(found - moved) < 1e-2 * found))
    seen = it.batch_with_constraints(points)
    for of, value, margins in zip(points, *seen, strict=True):  # traced, one by one, in NumPy
        at = it.problems[0].evaluate(it.expand(of))
        for found in (it(of), it.constraints(of)), (at.value, at.margins):
            np.testing.assert_allclose(found[0], value, rtol=1e-12)
            np.testing.assert_allclose(found[1], margins, rtol=1e-9, atol=1e-12)


def test_noise_is_of_the_seed_and_the_evaluation():
    def values(seed):
        it = toy(noise=0.1).objective(seed=seed)
        return [it(X), it(X), *it.batch([X, X])]

    first = values(0)
    assert len(set(first)) == 4
    assert values(0) == first
    assert not set(values(1)) & set(first)
    mean, feasible = toy(noise=0.1).value(X)
    assert feasible
    assert mean[0] == pytest.approx(0.5, abs=0.04)


def test_several_goals_keep_the_unbeaten():
    it = toy(goals=2).objective()
    assert it([0.0, 0.0]).tolist() == [1.0, 1.0]
    it([0.0, 0.4])
    it.batch([[0.25, 0.0], [-0.5, 0.0]])
    values = sorted(tuple(values) for _, values in it.record.front)
    assert values == [(0.5625, 1.5625), (1.0, 1.0), (2.25, 0.25)]
    assert it.record.improvements == []


def test_a_copy_in_another_process_refuses_to_count(monkeypatch):
    it = pickle.loads(pickle.dumps(toy().objective()))
    assert it(X) == pytest.approx(0.5)
    monkeypatch.setattr(os, "getpid", lambda: -1)
    with pytest.raises(RuntimeError, match="of another process"):
        it(X + 1)
