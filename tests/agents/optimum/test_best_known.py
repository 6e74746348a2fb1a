"""From an environment that the package does not know to what is known of its optimum."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.agents.evaluation.rollout import play
from stickslip.agents.evaluation.table import keep_of
from stickslip.agents.optimum import known, solve
from tests.agents.mass import Pull
from tests.agents.optimum.processes import ENV, PARAMS, MassStates

STATES = MassStates()


@pytest.fixture(scope="module")
def solution():
    return solve(ENV, PARAMS, states=STATES, actions=21)


@pytest.fixture(scope="module")
def found(solution):
    return known(solution, episodes=12)


def by_hand(act, seed: int) -> float:
    """What an episode earns, step by step through the public step."""
    key = jax.random.split(jax.random.key(seed))[1]
    env = replace(ENV, autoreset="disabled")
    obs, state = env.reset(key, PARAMS)
    total, over = 0.0, False
    while not over:
        action = act(obs, state, PARAMS)
        obs, state, reward, ended, late, _ = env.step(key, state, action, PARAMS)
        total, over = total + float(reward), bool(ended | late)
    return total


def test_the_lower_bound_is_what_the_policy_earns_step_by_step(solution, found):
    rewards = np.asarray(found.replay.reward)
    assert found.lower_bound == pytest.approx(rewards.mean())
    act = jax.jit(lambda *given: solution.policy.act(None, *given)[1])
    assert by_hand(act, 3) == pytest.approx(rewards[3], abs=1e-4)


def test_nobody_else_earns_as_much_and_the_grid_says_so(found):
    pulled = play(replace(ENV, autoreset="disabled"), Pull(), PARAMS, range(12), keep_of)
    assert found.lower_bound > np.mean(pulled.reward) + 1
    assert found.holds
    assert abs(found.estimate - found.lower_bound) < 0.02 * found.upper_bound
    assert found.lower_bound < found.upper_bound == 30.0


def test_a_value_that_its_policy_does_not_earn_is_not_known(solution, found):
    boast = replace(solution.policy, values=solution.policy.values + 5)
    told = known(replace(solution, policy=boast), episodes=12)
    assert told.lower_bound == pytest.approx(found.lower_bound)
    assert not told.holds


def test_states_that_the_grid_does_not_cover_are_reported(solution):
    narrow = solve(ENV, PARAMS, states=MassStates(low=0.0), actions=5, fineness=0.5)
    told = known(narrow, episodes=12)
    starts = np.asarray(told.replay.start.place)
    assert np.any(starts < 0)
    assert told.off_grid > 0
    assert not told.holds


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"actions": 1}, "actions = 1"),
        ({"fineness": 0.0}, "cells of place"),
        ({"grid": 3}, "grid = 3"),
        ({"states": None}, "env is a MassEnv"),
    ],
)
def test_bad_settings_are_refused_by_name(given, words):
    with pytest.raises(ValueError, match=words):
        solve(ENV, PARAMS, **({"states": STATES} | given))
