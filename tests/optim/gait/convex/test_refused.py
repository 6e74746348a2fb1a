"""Gait problems that cannot be met say why; what is not solved is not optimal; bad input."""

import re
from dataclasses import replace

import numpy as np
import pytest

from stickslip.optim import GaitProblem, OptimStatus, best_transfer, solve
from stickslip.optim.gait.convex import grid_problem
from tests.optim.gait.helpers import periodic, robot, solved, transfer


def test_a_motor_too_weak_to_start_is_named_with_what_it_takes():
    """That is the constant torque that just lifts the robot over its first step [N m]."""
    profile = transfer(1, steps=400).on_grid.profiles.nodes
    turned = profile.theta[0] - np.pi / 2
    steps = np.diff(turned) * (profile.fall[0, 1:] + profile.fall[0, :-1]) / 2
    needed = float(np.max(np.cumsum(steps) / turned[1:]))
    assert needed == pytest.approx(0.8403, abs=2e-4)
    found = solve(transfer(1, torque_limit=0.8, steps=100))
    assert found.status is OptimStatus.INFEASIBLE
    said = re.search(r"torque_limit = 0.8 N m: at least ([0-9.]+) N m is needed", found.message)
    assert float(said[1]) == pytest.approx(needed, rel=2e-2)
    assert solve(transfer(1, torque_limit=0.86, steps=100)).status is OptimStatus.OPTIMAL


def test_a_mean_rate_above_the_fastest_is_named_with_the_fastest():
    found = solve(periodic("energy", mu=0.06, mean_rate=9.0, steps=60))
    assert found.status is OptimStatus.INFEASIBLE
    fastest = np.pi / solved("time", mu=0.06, steps=60).value
    said = re.search(r"at most ([0-9.]+) rad/s .*, none above ([0-9.]+) rad/s", found.message)
    assert float(said[1]) == pytest.approx(fastest, rel=1e-4)
    assert float(said[2]) > float(said[1])
    lifted = solve(periodic("energy", mu=0.06, mean_rate=90.0, steps=60))
    assert "the foot lifts off whatever the motor and the floor" in lifted.message


@pytest.mark.parametrize(
    ("problem", "said"),
    [
        (lambda: periodic(min_normal=90.0, steps=40), r"min_normal = 90 N: at most 83\.\d+ N is"),
        (lambda: transfer(1, start_rate=60.0, steps=40), "start_rate = 60 rad/s: none such"),
        (
            lambda: GaitProblem.periodic(robot(heel=0.1, toe=0.1), zmp=True, mu=0.1, steps=40),
            "the foot's edges cannot hold the robot",
        ),
    ],
)
def test_the_limit_that_cannot_be_met_is_named(problem, said: str):
    found = solve(problem())
    assert found.status is OptimStatus.INFEASIBLE
    assert re.search(said, found.message), found.message
    assert found.x is None


@pytest.mark.parametrize("mu", [0.0, 1e-6])
def test_a_friction_below_the_grids_own_error_is_not_called_infeasible(mu: float):
    """With P x crank rate constant the foot needs no friction, so a gait exists at any."""
    for problem in (
        periodic(mu=mu, mean_rate=3.0, steps=60),
        periodic(mu=mu, mean_rate=3.0, zmp=True, steps=60),
        transfer(1, mu=mu, start_rate=3.0, end_rate=3.0, steps=60),
    ):
        found = solve(problem)
        assert found.status in (OptimStatus.INACCURATE, OptimStatus.VIOLATED), found.message
        said = f"a grid of 60 cells cannot resolve so small a friction as mu = {mu:g}"
        assert said in found.message


def test_too_slow_a_torque_and_the_fewest_steps_to_a_rate_are_told():
    walk = transfer(1, mu=0.06, end_rate=5.0, mean_rate=4.0, steps=20)
    by_count = [solve(replace(walk, steps_taken=count)) for count in (1, 2, 3)]
    assert [one.feasible for one in by_count] == [False, True, True]
    chosen, best = best_transfer(walk, 3)
    assert (chosen.steps_taken, best.value) == (2, by_count[1].value)
    slow = solve(replace(chosen, max_torque_rate=1.0))
    assert slow.status is OptimStatus.VIOLATED
    assert "within max_torque_rate = 1 N m/s; this one needs: torque rate" in slow.message


def test_a_solver_that_gives_up_is_not_called_optimal(monkeypatch):
    monkeypatch.setattr(grid_problem, "ACCURACY", {"max_iter": 4})
    found = solve(periodic(mu=0.05, steps=60))
    assert found.status in (OptimStatus.LIMIT, OptimStatus.FAILED, OptimStatus.VIOLATED)
    assert not found.status.solved


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"mu": -0.1}, "mu = -0.1"),
        ({"mu": [0.1, 0.2]}, r"mu has shape \(2,\)"),
        ({"mean_rate": float("nan")}, "mean_rate = nan"),
        ({"steps": 4}, "steps = 4"),
        ({"steps": 10**12}, "nodes, about"),
        ({"cells": 4}, "steps = 4"),
        ({"objective": {"time": 0.0}}, "a weight above 0"),
        ({"objective": {"tine": 1.0}}, "did you mean time"),
        ({"objective": {"friction": 1.0, "time": 1.0}}, "mu as a limit"),
        ({"objective": "friction", "mu": 0.1, "mean_rate": 3.0}, "mu with the objective"),
        ({"objective": "friction"}, "mean_rate = None"),
        ({"max_torque_rate": 0.0}, "max_torque_rate = 0.0"),
    ],
)
def test_bad_input_is_refused_by_name(options: dict, said: str):
    with pytest.raises(ValueError, match=said):
        periodic(**options)


def test_a_robot_that_cannot_exchange_support_may_take_one_step_only():
    centre = np.array(robot().centre)
    centre[7] = 0.01, 0.0  # of the double crank, whose arms change places
    crooked = robot().replace(centre=centre)
    with pytest.raises(ValueError, match="breaks the exchange of support"):
        GaitProblem.periodic(crooked)
    with pytest.raises(ValueError, match="breaks the exchange of support"):
        GaitProblem.transfer(crooked, 2)
    assert GaitProblem.transfer(crooked, 1).steps_taken == 1
    batch = replace(robot(), payload=np.array([0.0, 1.0]))
    with pytest.raises(ValueError, match="batch"):
        GaitProblem.periodic(batch)
