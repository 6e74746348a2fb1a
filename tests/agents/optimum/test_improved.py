"""A controller that tries other actions before it follows its base."""

from __future__ import annotations

import itertools

import jax
import numpy as np
import pytest

from stickslip.agents.evaluation.rollout import Idle, episode_key, horizon, play, without_resets
from stickslip.agents.evaluation.standard import keep_of
from stickslip.agents.optimum import Improved
from tests.agents.optimum.processes import ENV as RESETTING
from tests.agents.optimum.processes import PARAMS

ENV = without_resets(RESETTING)
COUNT = 5


def returns(controller) -> np.ndarray:
    return play(ENV, controller, PARAMS, range(6), keep_of).reward


def test_with_the_whole_episode_ahead_it_never_earns_less_than_its_base():
    base = Idle()
    better = returns(Improved(base, ENV, COUNT, horizon(PARAMS)))
    before = returns(base)
    assert np.all(better >= before - 1e-5)
    assert better.mean() > before.mean() + 0.1


def test_the_action_is_the_one_that_earns_most_with_the_base_after_it():
    improved = Improved(Idle(), ENV, COUNT, 2)
    key = jax.random.key(0)
    for seed in range(3):
        obs, state = ENV.reset(episode_key(seed), PARAMS)
        _, action = improved.act(improved.init(PARAMS, state), obs, state, PARAMS)
        worth = {}
        for first in np.linspace(-1, 1, COUNT, dtype=np.float32):
            at, earned = state, 0.0
            for one in itertools.chain([first], [0.0, 0.0]):
                if not bool(ENV.is_over(at)):
                    _, at, reward, *_ = ENV.step(key, at, np.float32([one]), PARAMS)
                    earned += float(reward)
            worth[float(first)] = earned
        best = max(worth.values())
        assert worth[float(np.asarray(action)[0])] == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"count": 1}, "count = 1"),
        ({"horizon": 2.5}, "horizon = 2.5"),
        ({"env": "biped"}, "env = 'biped'"),
        ({"env": RESETTING}, "autoreset = 'same_step'"),
    ],
)
def test_bad_settings_are_refused_by_name(given, said):
    settings = {"base": Idle(), "env": ENV, "count": COUNT, "horizon": 2} | given
    with pytest.raises(ValueError, match=said):
        Improved(**settings).validate()
