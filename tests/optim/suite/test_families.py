"""The instances' functions against the rest of the package: one meaning in two places."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import simulate
from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import PostureProblem, instance
from stickslip.optim.suite.families import design, gains, shooting
from stickslip.optim.suite.families.split import drive_family, split_problem
from stickslip.optim.torque_split import TorqueSplit

SLOPES = 1e-6


def test_a_split_costs_what_the_split_of_each_posture_does():
    with jax.enable_x64(True):
        problem, family = split_problem("bump", "squared_torque", 8), drive_family("bump", 8)
    splits = TorqueSplit("squared_torque").along(UGVParams(), family)
    x = np.array([one.difference for one in splits]) / float(UGVParams().weight)
    assert problem.is_feasible(x)
    assert problem.objective(x) == pytest.approx(sum(one.value for one in splits), rel=1e-9)
    slope = problem.gradient(x)
    assert np.abs(slope).max() < 1e-4 * problem.objective(np.full(8, 0.1))


def test_the_reference_robot_as_a_design_is_the_reference_robot():
    one = instance("design-biped-friction-d12-v1")
    value, feasible = one.value(np.ones(12))
    assert feasible
    assert value[0] == pytest.approx(0.0797, abs=5e-4)  # 0.08 at 3 rad/s in the chapter
    assert one.best_known < 0.7 * value[0]


def test_the_usual_vehicle_as_a_design_drives_as_a_posture_problem_says():
    with jax.enable_x64(True):
        problem = design.vehicle_design("wheel_energy", ("sinusoid",))
    usual = UGVParams()
    straight = [float(usual.body_length), float(usual.leg_length), np.pi / 2, np.pi / 2]
    x = np.linspace(2.5, 8.0, design.STATIONS)
    drive = PostureProblem(usual, design.track_named("sinusoid"), x)
    expected = drive.objective(np.full(drive.n, np.pi / 2))
    assert problem.objective(straight) == pytest.approx(expected, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("scene", ["slippery", "patch"])
def test_shooting_is_the_simulator_s_walk(scene):
    with jax.enable_x64(True):
        problem = shooting.shooting_problem(scene, 6)
        x = np.linspace(0.5, -0.3, 6)
        model, floor, state = problem.data
        torques = np.repeat(x, shooting.HELD)
        walk = simulate(model, floor, state, torques, len(torques) * shooting.DT, shooting.DT)
        rate = np.asarray(walk.states.crank_rate)[1:]
        slid = float(np.sum(np.asarray(walk.contacts.slide_distance)))
    assert int(walk.status) <= 1
    expected = np.mean((rate / 3 - 1) ** 2 + shooting.TORQUE_WEIGHT * (torques / 4) ** 2)
    assert problem.objective(x) == pytest.approx(expected + shooting.SLIDE_WEIGHT * slid, rel=1e-9)
    slope = problem.gradient(x)
    moved = [
        (problem.objective(x + d) - problem.objective(x - d)) / (2 * SLOPES)
        for d in SLOPES * np.eye(6)
    ]
    assert slope == pytest.approx(moved, rel=1e-4, abs=1e-6)


@pytest.mark.long
def test_gains_draw_floors_and_falls_cost():
    with jax.enable_x64(True):
        problem = gains.gains_problem(2, 3.0, 4)
    good, none = np.array([1.0, 0.3]), np.array([0.0, -2.0])
    drawn = [problem.drawn(i).objective(good) for i in range(3)]
    assert len(set(drawn)) == 3
    assert max(drawn) < problem.objective(none)
