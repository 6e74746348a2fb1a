"""A subclass's reward is what a step returns and what an episode adds up."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.machine import machine_of_env
from stickslip.envs import BipedEnv


class Saving(BipedEnv):
    """Nothing counts but torque."""

    def reward_of(self, state, action, info, params):
        return info["torque"] * 0 - action[0] ** 2 - 0.1 * state.elapsed


def test_it_is_returned_and_added_up():
    env = Saving(autoreset="disabled")
    params = env.make_params()
    state, total = env.reset(jax.random.key(0), params)[1], 0.0
    for step, action in enumerate((0.1, -0.2, 0.0)):
        given = jnp.full(1, action)
        _, state, reward, _, _, info = env.step(jax.random.key(0), state, given, params)
        total += float(reward)
        np.testing.assert_allclose(reward, -(action**2) - 0.1 * step, rtol=1e-5)
        np.testing.assert_allclose(info["episode_return"], total, rtol=1e-5)
    assert machine_of_env(env).name == "biped"


def test_the_usual_one_is_the_sum_of_its_terms():
    env = BipedEnv()
    params = env.make_params()
    state = env.reset(jax.random.key(0), params)[1]
    info = env.step(jax.random.key(0), state, jnp.full(1, 0.3), params)[5]
    terms = [info[f"reward_{name}"] for name in ("tracking", "slip", "energy", "fall")]
    assert float(terms[0]) != 0.0
    np.testing.assert_allclose(info["episode_return"], sum(map(float, terms)), rtol=1e-5)
