"""The usual vehicle as a design."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams
from stickslip.optim import PostureProblem
from stickslip.optim.instances.ugv.posture import track_named
from stickslip.optim.instances.ugv.vehicle import STATIONS, vehicle_design


def test_the_usual_vehicle_as_a_design_drives_as_a_posture_problem_says():
    with jax.enable_x64(True):
        problem = vehicle_design("wheel_energy", ("sinusoid",))
    usual = UGVParams()
    straight = [float(usual.body_length), float(usual.leg_length), np.pi / 2, np.pi / 2]
    x = np.linspace(2.5, 8.0, STATIONS)
    drive = PostureProblem(usual, track_named("sinusoid"), x)
    expected = drive.objective(np.full(drive.n, np.pi / 2))
    assert problem.objective(straight) == pytest.approx(expected, rel=1e-9)
