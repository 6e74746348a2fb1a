"""A drive's split is that of its postures."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams
from stickslip.optim.instances.ugv.split import drive_family, split_problem
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
