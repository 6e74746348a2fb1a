"""The UGV's instances: splits are those of postures, the usual vehicle is a design."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import PostureProblem
from stickslip.optim.instances.ugv import (
    STATIONS,
    drive_family,
    split_problem,
    track_named,
    vehicle_design,
)
from stickslip.optim.torque_split import TorqueSplit


def test_a_split_costs_what_the_split_of_each_posture_does():
    with jax.enable_x64(True):
        problem, family = split_problem("bump", "squared_torque", 8), drive_family("bump", 8)
    splits = TorqueSplit("squared_torque").along(UGVParams(), family)
    x = np.array([one.difference for one in splits]) / float(UGVParams().weight)
    assert problem.is_feasible(x)
    assert problem.objective(x) == pytest.approx(sum(one.value for one in splits), rel=1e-9)
    slope = problem.gradient(x)
    assert np.abs(slope).max() < 1e-4 * problem.objective(np.full(8, 0.1))


def test_the_usual_vehicle_as_a_design_drives_as_a_posture_problem_says():
    with jax.enable_x64(True):
        problem = vehicle_design("wheel_energy", ("sinusoid",))
    usual = UGVParams()
    straight = [float(usual.body_length), float(usual.leg_length), np.pi / 2, np.pi / 2]
    x = np.linspace(2.5, 8.0, STATIONS)
    drive = PostureProblem(usual, track_named("sinusoid"), x)
    expected = drive.objective(np.full(drive.n, np.pi / 2))
    assert problem.objective(straight) == pytest.approx(expected, rel=1e-9)
