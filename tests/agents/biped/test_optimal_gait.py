"""Following a gait: from any state, at any commanded rate, for other robots, too."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents import GaitTable, OptimalGait, gaits_of
from stickslip.agents.evaluation.rollout import episode_key, rollout
from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import BipedParams
from stickslip.envs import BipedEnv
from stickslip.envs.biped.params import Randomisation

ENV = BipedEnv()
RATES = (2.0, 3.0, 4.0)


@pytest.fixture(scope="module")
def gaits() -> GaitTable:
    robot = BipedParams.from_bars()
    return gaits_of(robot, RATES, "energy", mu=0.045, torque_limit=3.6, steps=32)


def test_it_walks_from_rest_and_from_anywhere_and_comes_to_the_gaits_mean_rate(gaits: GaitTable):
    drawn = Randomisation(phase=(1.6, 4.7), crank_rate=(0.0, 4.0))
    params = ENV.make_params(
        scene=Scene.uniform(0.08, 0.07), time_limit=6.0, commanded_rate=3.0, randomisation=drawn
    )
    follow = OptimalGait(gaits=gaits).validate()
    keys = jax.vmap(episode_key)(jnp.arange(6))
    played = jax.vmap(lambda key: rollout(ENV, follow, params, key, 300))(keys)
    assert not np.any(played.terminated)
    angle = np.asarray(played.state.biped.crank_angle)
    rate = (angle[:, -1] - angle[:, 150]) / ((angle.shape[1] - 1 - 150) * 0.02)
    np.testing.assert_allclose(rate, 3.0, atol=0.25)
    slid = np.asarray(played.info["episode_slid"])[:, -1]
    assert np.all(slid < 0.01)
    assert np.all(np.asarray(played.info["status"]) <= Status.SLIP_ONSET)


def test_a_mixture_of_gaits_lies_between_them(gaits: GaitTable):
    phase = jnp.asarray(2.2)
    _, slow = gaits.target(jnp.asarray(gaits.mean_rate[0]), phase)
    _, fast = gaits.target(jnp.asarray(gaits.mean_rate[1]), phase)
    between = jnp.asarray((gaits.mean_rate[0] + gaits.mean_rate[1]) / 2)
    _, mixed = gaits.target(between, phase)
    np.testing.assert_allclose(mixed, (slow + fast) / 2, rtol=1e-4)
    _, beyond = gaits.target(jnp.asarray(99.0), phase)
    _, last = gaits.target(jnp.asarray(gaits.mean_rate[-1]), phase)
    np.testing.assert_allclose(beyond, last, rtol=1e-6)


def test_bad_settings_and_robots_without_a_gait_are_refused(gaits: GaitTable):
    for settings, said in (
        ({"friction": 0.0}, "friction"),
        ({"footing": 1.5}, "footing"),
        ({"gaits": None}, "GaitTable"),
    ):
        with pytest.raises(ValueError, match=said):
            OptimalGait(**{"gaits": gaits} | settings).validate()
    with pytest.raises(ValueError, match="no gait for any of the rates: mean_rate = 90"):
        gaits_of(BipedParams.from_bars(), [90.0], "energy", mu=0.045, torque_limit=3.6, steps=32)
    with pytest.raises(ValueError, match="one or more periodic"):
        GaitTable.of([])
