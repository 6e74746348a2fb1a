"""Events of a run: values that fall, in evaluations and time."""

from types import SimpleNamespace

import numpy as np
import pytest

from stickslip.agents.optimisers import worker
from stickslip.agents.optimisers.methods import methods_of
from stickslip.agents.optimisers.report import gap
from stickslip.agents.optimisers.worker import EventRecord, Task, run_task
from stickslip.optim import instance, suite
from tests.agents.optimisers import users
from tests.agents.optimisers.table import BEST, NAME


def test_events_are_steps_of_the_gap_and_the_end_has_the_best():
    known = suite()[NAME].known
    middle = suite()[NAME].objective().middle

    def walks(objective, seed):
        for share in np.linspace(0, 1, 30):
            objective(share * known.x + (1 - share) * middle)

    (method,) = methods_of({"walks": walks})
    run = run_task(Task(NAME, method, 0, 100, None))
    assert (run.outcome, run.counts["values"]) == ("ended", 30)
    assert np.all(np.diff(run.evaluations[:-1]) > 0)
    assert np.all(np.diff(run.values[:-1]) < 0)
    assert run.best == pytest.approx(BEST, rel=1e-6)
    assert run.evaluations[-1] == 30
    np.testing.assert_array_equal(run.point, known.x)
    assert suite()[NAME].value(run.point)[0][0] == pytest.approx(run.best)
    assert np.all(np.diff(run.seconds) >= 0)


def test_time_is_the_processor_s_and_ends_a_run():
    (method,) = methods_of({"searches": users.searches})
    run = run_task(Task(NAME, method, 0, None, 0.05))
    assert run.outcome == "spent"
    assert 0.05 < run.seconds[-1] < 1


@pytest.mark.parametrize("budget", [None, 40])
def test_the_trial_before_a_run_compiles_batches_of_its_sizes(budget, monkeypatch):
    sizes = []

    def batches(objective, seed):
        for _ in range(3):
            values = objective.batch(np.tile(objective.middle, (64, 1)))
            sizes.append((type(objective).__name__, len(values)))

    monkeypatch.setattr(worker, "pickle", SimpleNamespace(loads=lambda task: task))
    (method,) = methods_of({"batches": batches})
    run = worker.make_run(Task(NAME, method, 0, budget, None))
    assert run.evaluations[-1] == (budget or 3 * 64)
    assert sizes.count(("_Trial", 64)) == (0 if budget else 2)


def test_a_noisy_value_is_judged_by_other_draws_and_a_gap_by_the_best_known(monkeypatch):
    noisy = suite()["gains-rate3-d4-v1"]
    monkeypatch.setattr(type(noisy), "value", lambda self, x: (np.array([float(x[0])]), True))
    record = EventRecord(instance=noisy)
    best = noisy.best_known
    for number, (mean, drawn) in enumerate([(3.0, 2.0), (4.0, 1.0), (2.0, 0.5), (1.0, 5.0)], 1):
        record.values = number
        record.note(np.full(4, mean * best), np.array([drawn]), True)
    assert [one.value / best for one in record.events] == pytest.approx([3.0, 2.0])
    assert record.end().value == pytest.approx(2 * best)
    assert record.end().point[0] == 2 * best  # of the mean, not of the luckiest draw
    assert gap(noisy, 2 * best) == pytest.approx(1.0)


def test_where_no_value_is_known_every_improvement_is_an_event():
    record = EventRecord(instance=instance(NAME, 10**6))
    for number, value in enumerate((3.0, 2.9999, 3.0, 2.9998), 1):
        record.values = number
        record.note(np.zeros(16), np.array([value]), True)
    assert [one.evaluations for one in record.events] == [1, 2, 4]
    assert np.isnan(gap(record.instance, 3.0))
