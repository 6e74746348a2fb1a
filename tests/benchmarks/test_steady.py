"""A bound on the reward of steady walking: above every gait, and near the best."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tasks import bound_steady_reward
from stickslip.envs import known_of, task_by_name
from stickslip.optim import GaitProblem, solve
from tests.optim.gait.helpers import robot

FLOOR = {"mu": 0.06, "torque_limit": 2.0}


def steady_reward(gait, params, rate: float, energy_weight: float) -> float:
    """Of a second, speed that varies within the step left out."""
    usual, step = np.pi / rate, gait.nodes.robot
    tracking = max(1 - abs(usual / gait.duration - 1), -1.0)
    energy = gait.spent["work"] + 0.5 * gait.spent["torque"]
    speed = step.step_length / usual
    return tracking - energy_weight * energy / (step.weight * speed) / gait.duration


@pytest.fixture(scope="module")
def bound():
    return bound_steady_reward(robot(), 5.0, **FLOOR, cells=40)


@pytest.mark.long
def test_no_gait_earns_more_and_one_of_its_rate_nearly_as_much(bound):
    for asked in (2.0, 3.7, bound.mean_rate):
        limits = FLOOR | {"mean_rate": asked, "zmp": True}
        gait = solve(GaitProblem.periodic(robot(), "energy", steps=40, **limits)).best
        earned = steady_reward(gait, robot(), 5.0, 0.5)
        assert earned <= bound.value
    assert bound.value - earned < 0.03


def test_a_few_cells_come_near_what_is_written_of_the_task(bound):
    task = task_by_name("BipedWeakMotor-v0")
    written = known_of(task).assumed.value / task.parameters["time_limit"]
    assert written <= bound.value <= 1.04 * written  # coarser: looser


def test_without_a_price_it_is_the_fastest_gaits_tracking():
    found = bound_steady_reward(robot(), 15.0, mu=0.06, torque_limit=4.0, energy_weight=0, cells=40)
    fastest = solve(GaitProblem.periodic(robot(), mu=0.06, torque_limit=4.0, zmp=True, steps=40))
    tracking = fastest.best.mean_rate / 15.0
    assert tracking <= found.value <= 1.04 * tracking
