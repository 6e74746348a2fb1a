"""Frozen trees keep the numbers that they were made of; those of equal numbers are equal."""

import pickle

import jax
import numpy as np
import pytest

from stickslip.agents import OptimalGait
from stickslip.agents.biped.prediction import GaitTable
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState
from stickslip.dynamics.ugv import Track, UGVParams
from stickslip.envs import BipedEnv, Randomisation, UGVEnv

MAKERS = {
    "uniform": Scene.uniform,
    "no axis": lambda x: Scene.uniform(x[0, ...], payload=x[1, ...]),
    "patches": lambda x: Scene.patches(x, [0.5, 0.05, 0.5], payload=x[:1]),
    "bars": lambda x: BipedParams.from_bars(payload=x),
    "robot": lambda x: BipedParams.from_bars().replace(payload=x),
    "state": lambda x: BipedState(crank_rate=x),
    "vehicle": lambda x: UGVParams(wheel_mass=x),
    "track": lambda x: Track.from_points(x, x),
    "range": lambda x: Randomisation(payload=(x[0, ...], x[1, ...])),
    "biped": lambda x: BipedEnv().make_params(copper_loss=x),
    "ugv": lambda x: UGVEnv().make_params(speed=x),
    "gait": lambda x: OptimalGait(friction=x, gaits=GaitTable(x, x, x)),
}


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_a_tree_keeps_its_numbers_and_equals_its_copy(make):
    given = np.array([0.5, 1.0])
    made, other, expected = make(given), make(given + 0.25), make(given.copy())
    given[:] = 9.0
    for one, same in zip(jax.tree.leaves(made), jax.tree.leaves(expected), strict=True):
        np.testing.assert_array_equal(one, same)
    assert made == expected == pickle.loads(pickle.dumps(made)) != other
