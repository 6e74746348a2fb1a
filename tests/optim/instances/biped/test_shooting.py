"""Shooting is what the simulator does."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import simulate
from stickslip.optim.instances.biped import shooting

SLOPES = 1e-6


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
