"""What is known of the tasks: of these definitions, in order, and not from damaged files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents.policy.file import record_of
from stickslip.agents.policy.shipped import policy_name
from stickslip.envs.tasks.definition import TASKS
from stickslip.envs.tasks.known import Earned, Known, Scale, bootstrapped, known_of

NAMES = list(TASKS)


@pytest.mark.parametrize("name", NAMES)
def test_every_task_is_measured_and_its_numbers_are_in_order(name):
    found = known_of(TASKS[name])
    assert found is not None
    everybody = (*found.baselines, *found.planners)
    assert found.best.value >= max(one.value for one in everybody if found.keeps(one.cost))
    assert found.keeps(found.best.cost)
    assert found.trivial.value < found.best.value
    assert found.how
    for one in (*everybody, found.best, found.trivial):
        assert (one.low is None) == (found.episodes == 1)
        if one.low is not None and one.high is not None:
            assert one.low <= one.value <= one.high
    if found.bound is not None:
        assert found.best.value <= found.bound.value
    if found.assumed is not None:
        assert found.bound is None or found.assumed.value < found.bound.value
        assert "if" in found.assumed.reason


@pytest.mark.parametrize("name", NAMES)
def test_a_task_s_tier_is_that_of_the_learners_tried(name):
    task, found = TASKS[name], known_of(TASKS[name])
    seeds = [found.scale.score(one) for one in found.learned.returns] if found.learned else [0.0]
    checked, best = np.mean(seeds) >= 0.9, max(*seeds, record_of(policy_name(name)).score.value)
    assert task.tier == ("check" if checked else "hard" if best < 0.8 else "core")


def test_a_score_is_nought_for_the_trivial_one_for_the_best_and_straight_between():
    scale = Scale(-2.0, 6.0)
    assert [scale.score(one) for one in (-2.0, 6.0, 2.0, 10.0, -4.0)] == [0, 1, 0.5, 1.5, -0.25]
    for zero, one in ((1.0, 1.0), (2.0, 1.0), (float("nan"), 1.0)):
        with pytest.raises(ValueError, match="zero < one"):
            Scale(zero, one)


def test_the_interval_of_a_score_is_of_what_the_same_episodes_differ_by():
    rng = np.random.default_rng(1)
    zero = rng.normal(0.0, 100.0, 64)
    one, returns = zero + 10.0, zero + 4.0 + rng.normal(0.0, 1.0, 64)
    ratio = lambda r, z, o: (r - z) / (o - z)  # noqa: E731
    paired = bootstrapped(ratio, returns, zero, one, paired=True)
    assert paired.value == pytest.approx(np.mean(returns - zero) / 10)
    half = 1.96 * np.std(returns - zero, ddof=1) / 8 / 10  # the difference's own
    assert [paired.low, paired.high] == pytest.approx(
        [paired.value - half, paired.value + half], abs=0.3 * half
    )
    others = bootstrapped(ratio, returns, zero[:32], one[:32], paired=False)
    assert others.high - others.low > 50 * half
    assert bootstrapped(ratio, one, zero, one, paired=True) == (1.0, 1.0, 1.0)
    assert not np.isfinite(bootstrapped(ratio, [1.0], [0.0], [2.0], paired=True).high)


def test_some_of_a_task_s_own_episodes_are_compared_with_the_same_ones():
    zero, one = (0.0, 10.0, 20.0, 30.0), (10.0, 20.0, 30.0, 50.0)
    both = (("z", zero), ("o", one))
    rows = [Earned(name, np.mean(of), None, None, 0.0, of) for name, of in both]
    found = Known(4, rows[0], (), (), rows[1], "", None)
    assert found.score([5.0, 15.0], (0, 1)) == (0.5, 0.5, 0.5)
    assert found.gap([5.0, 40.0], (0, 3)).value == pytest.approx(7.5)
    assert found.score([5.0, 15.0]).value == pytest.approx((10 - 15) / (27.5 - 15))
    assert found.score_of(rows[1]) == (1.0, 1.0, 1.0)
    lost = replace(rows[1], returns=())
    for score in (found.score_of(lost), replace(found, best=lost).score([15.0, 40.0], (0, 1))):
        assert score.value == 1.0
        assert not np.isfinite(score.low + score.high)


def test_scores_of_another_definition_are_refused_and_none_are_none():
    task = TASKS[NAMES[0]]
    changed = replace(task, parameters={**task.parameters, "mean_rate": 3.5})
    with pytest.raises(ValueError, match="measured by another definition"):
        known_of(changed)
    assert known_of(replace(task, version=99)) is None
