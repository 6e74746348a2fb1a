"""The UGV's baselines and planners, and the table that compares them with the optimum."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest

from stickslip.agents import evaluate
from stickslip.agents.evaluation.rollout import first_state, rollout
from stickslip.agents.ugv.controllers import FixedPosture, FollowPath, LevelBody, Optimum
from stickslip.dynamics.ugv import Track
from stickslip.optim import solve
from tests.envs.ugv.helpers import task

pytestmark = pytest.mark.long


def total(env, params, controller) -> float:
    played = rollout(env, controller, params, 0)
    assert played.truncated[-1]
    return float(played.reward.sum())


@lru_cache
def held() -> float:
    env, params = task()
    return total(env, params, FollowPath(np.asarray(first_state(env, params, 0).leg_angles)[None]))


def test_the_optimisers_path_played_back_returns_minus_its_value(float64):
    env, params = task(dtype="float64")
    problem = env.problem(first_state(env, params, 0), params)
    found = solve(problem, "dp", polish=False, angles=22)
    assert found.status.solved
    assert total(env, params, FollowPath(found.leg_angles)) == pytest.approx(-found.value, rel=1e-9)


def test_the_best_fixed_posture_is_the_best_of_those_it_looks_at():
    env, params = task()
    best = total(env, params, FixedPosture(env, 3))
    for rear in (30.0, 90.0, 150.0):
        for front in (30.0, 90.0, 150.0):
            path = FollowPath(np.radians([[rear, front]]))
            earned = rollout(env, path, params, 0).reward.sum()  # of wheels that overlap, a failure
            assert float(earned) <= best + 1e-3
    assert best > held()


def test_the_level_rule_takes_out_the_pitch_of_a_slope():
    env, _ = task()
    slope = env.make_params(track=Track.incline(0.2, end=4.0))
    played = rollout(env, LevelBody(), slope, 0)
    assert played.truncated[-1]
    pitch = np.asarray(played.state.attitude.pitch)
    assert pitch[0] > 0.1
    assert abs(pitch[-1]) < 0.3 * pitch[0]


def test_a_table_has_the_cost_of_drives_that_reached_the_end():
    env, params = task()
    path = Optimum().path(env, params, first_state(env, params, 0))
    slippery = params.replace(friction=0.01)
    table = evaluate(
        env,
        {"held": FollowPath(path.angles[:1]), "played": path},
        {"bump": params, "slippery": slippery},
        episodes=2,
    )
    row = table.row("bump", "played")
    assert row.count == 1  # nothing is drawn
    cost = table.row("bump", "held").metrics["cost"].value
    assert row.metrics["cost"].value < cost
    failed = table.row("slippery", "held")
    assert failed.metrics["failures"].value == 1.0
    assert np.isnan(failed.metrics["cost"].value)


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        (FollowPath(np.zeros(2)), r"angles has shape \(2,\); accepted: \[K, 2\]"),
        (FixedPosture(count=0), r"count = 0; accepted: an integer >= 1"),
        (LevelBody(gain=-1.0), r"gain = -1\.0"),
        (Optimum(angles=1), r"angles = 1; accepted: an integer >= 2"),
    ],
)
def test_bad_settings_are_named(controller, message):
    with pytest.raises(ValueError, match=message):
        controller.validate()
