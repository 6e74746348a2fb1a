"""The UGV's instances: splits are those of the ground forces, the usual vehicle is a design."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams, equilibrium, ground_forces
from stickslip.optim import PostureProblem
from stickslip.optim.instances.ugv import (
    STATIONS,
    split_problem,
    track_named,
    vehicle_design,
)


def test_a_split_costs_the_squared_torques_of_the_forces_that_hold_each_posture():
    params, track, x = UGVParams(), track_named("bump"), np.linspace(2.0, 7.5, 8)
    shares = 0.1 * np.sin(np.arange(8))
    with jax.enable_x64(True):
        problem = split_problem("bump", "squared_torque", 8)
        pose = equilibrium(params, track.astype(float), x, np.full((8, 2), np.pi / 2)).pose
        forces = np.asarray(ground_forces(params, pose, shares * params.weight))
    F, N = forces[::2], forces[1::2]
    expected = np.sum((F * params.wheel_radius) ** 2)
    assert problem.objective(shares) == pytest.approx(expected, rel=1e-12)
    margins = np.stack([0.8 * N - F, 0.8 * N + F, N], axis=0)
    found = np.sort(problem.constraints(shares)) * float(params.weight)
    np.testing.assert_allclose(found, np.sort(margins.ravel()), rtol=1e-9)


def test_the_usual_vehicle_as_a_design_drives_as_a_posture_problem_says():
    with jax.enable_x64(True):
        problem = vehicle_design("wheel_energy", ("sinusoid",))
    usual = UGVParams()
    straight = [float(usual.body_length), float(usual.leg_length), np.pi / 2, np.pi / 2]
    x = np.linspace(2.5, 8.0, STATIONS)
    drive = PostureProblem(usual, track_named("sinusoid"), x)
    expected = drive.objective(np.full(drive.n, np.pi / 2))
    assert problem.objective(straight) == pytest.approx(expected, rel=1e-9)
