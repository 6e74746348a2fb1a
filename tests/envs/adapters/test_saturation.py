"""A finite action beyond [-1, 1] saturates in every adapter; what is no number is named."""

from __future__ import annotations

from typing import Any

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.envs import FunctionalEnv
from stickslip.envs.adapters.gymnax import GymnaxEnv
from tests.envs.toy import PARAMS, Toy, one_toy, toys

KEY = jax.random.key(0)


def single(push: Any) -> np.ndarray:
    env = one_toy()
    env.reset(seed=0)
    return env.step(np.array([push, 0.0]))[0]


def vector(push: Any) -> np.ndarray:
    env = toys()
    env.reset(seed=0)
    return env.step(np.array([[0, 0], [push, 0], [0, 0]]))[0][1]


def processes(push: Any) -> np.ndarray:
    envs = gymnasium.vector.AsyncVectorEnv([one_toy], context="spawn")
    try:
        envs.reset(seed=0)
        return envs.step(np.array([[push, 0.0]]))[0]
    finally:
        envs.close()


def sb3(push: Any) -> np.ndarray:
    pytest.importorskip("stable_baselines3")
    from stickslip.envs.adapters.sb3 import SB3VecEnv

    env = SB3VecEnv(Toy("same_step"), PARAMS, 3)
    env.reset()
    return env.step(np.array([[0, 0], [push, 0], [0, 0]]))[0][1]


def functional(push: Any, env: Any = Toy()) -> np.ndarray:  # noqa: B008
    state = env.reset(KEY, PARAMS)[1]
    return env.step(KEY, state, [push, 0.0], PARAMS)[0]


def gymnax(push: Any) -> np.ndarray:
    return functional(push, GymnaxEnv(Toy(), PARAMS))


ONE, MANY = (single, functional, gymnax), (vector, sb3)
APART = pytest.param(processes, marks=pytest.mark.long)


@pytest.mark.parametrize("step", [*ONE, *MANY, APART])
@pytest.mark.parametrize("push", [1e300, -3])
def test_a_finite_action_saturates(step, push):
    np.testing.assert_array_equal(step(push), step(float(np.sign(push))))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("step", [*ONE, *MANY])
def test_what_is_no_finite_number_is_named_by_its_place(step, bad):
    place = r"\[0\]" if step in ONE else r"\[1, 0\]"
    message = rf"action{place} = {bad} .*accepted: finite numbers, which saturate beyond \[-1, 1\]"
    with pytest.raises(ValueError, match=message):
        step(bad)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ([[0, 0], [0], [0, 0]], r"action = \[\[0, 0\], \[0\], \[0, 0\]\] is not a number"),
        ([[0, 0], [0, 0], [None, 0]], "not a number"),
        ([[0, 0], [0, 0]], r"action has shape \(2, 2\); accepted: \(3, 2\), .*push, idle"),
        (np.zeros((3, 2), complex), "not a number"),
        (np.ma.masked_array(np.zeros((3, 2)), mask=True), "masked"),
    ],
)
def test_a_wrong_shape_or_kind_is_refused(actions, message):
    env: FunctionalEnv = Toy()
    with pytest.raises(ValueError, match=message):
        env.check_action(actions, (3,))


def test_a_list_of_actions_is_an_array():
    given = [[0.5, -2.0], jnp.array([0.1, 0.2]), np.array([3, 0])]
    np.testing.assert_allclose(Toy().check_action(given, (3,)), [[0.5, -1], [0.1, 0.2], [1, 0]])
