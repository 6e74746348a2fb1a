"""Environments in one call do what single ones do, whatever is asked of them in which order."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from gymnasium.vector import AutoresetMode
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.toy import one_toy, toys

COUNT = 3
pushes = st.lists(st.floats(-1, 1, width=32), min_size=COUNT, max_size=COUNT)
masks = st.lists(st.booleans(), min_size=COUNT, max_size=COUNT)


@lru_cache
def environments():
    """Compiled once; every example begins with a reset of all."""
    return toys(COUNT, AutoresetMode.DISABLED), [one_toy() for _ in range(COUNT)]


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1 - COUNT), uses=st.lists(st.tuples(pushes, masks), max_size=12))
def test_steps_and_resets_of_some_in_any_order(seed: int, uses: list):
    many, singles = environments()
    obs, _ = many.reset(seed=seed)
    for i, env in enumerate(singles):
        np.testing.assert_array_equal(env.reset(seed=seed + i)[0], obs[i])
    for push, mask in uses:
        actions = np.stack([push, np.zeros(COUNT)], axis=1).astype(np.float32)
        obs, reward, terminated, truncated, infos = many.step(actions)
        for i, env in enumerate(singles):
            one = env.step(actions[i])
            np.testing.assert_allclose(obs[i], one[0], rtol=1e-5, atol=1e-6)
            np.testing.assert_allclose(reward[i], one[1], rtol=1e-5, atol=1e-6)
            assert (terminated[i], truncated[i]) == one[2:4]
            assert infos["episode_length"][i] == one[4]["episode_length"]
        again = np.array(mask) | terminated | truncated
        if again.any():
            fresh, _ = many.reset(options={"reset_mask": again})
            for i in np.flatnonzero(again):
                np.testing.assert_array_equal(fresh[i], singles[i].reset()[0])
            np.testing.assert_array_equal(fresh[~again], obs[~again])
