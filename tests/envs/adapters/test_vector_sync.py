"""The Gymnasium vector environment does what Gymnasium's own over single ones does, to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from tests.envs.toy import one_toy, toys

pytestmark = pytest.mark.usefixtures("xla_defaults")
MODES = list(AutoresetMode)


@pytest.mark.parametrize("mode", MODES)
def test_gymnasiums_sync_vector_env_of_the_single_ones_agrees(mode):
    sync = SyncVectorEnv([one_toy] * 3, autoreset_mode=mode)
    ours = toys(3, mode)
    random = np.random.default_rng(0)
    over = np.zeros(3, bool)
    assert np.array_equal(sync.reset(seed=4)[0], ours.reset(seed=4)[0])
    for _ in range(60):
        if mode is AutoresetMode.DISABLED and over.any():
            again = [env.reset(options={"reset_mask": over})[0] for env in (sync, ours)]
            np.testing.assert_array_equal(*again)
        actions = random.uniform(-1, 1, (3, 2)).astype(np.float32)
        one, other = sync.step(actions), ours.step(actions)
        for given, expected in zip(other[:4], one[:4], strict=True):
            np.testing.assert_allclose(given, expected, rtol=1e-6)
            assert given.dtype == expected.dtype
            assert given.shape == expected.shape
        same_infos(other[4], one[4])
        over = one[2] | one[3]


def same_infos(given: dict, expected: dict) -> None:
    assert set(given) == set(expected)
    for name, value in expected.items():
        if isinstance(value, dict):
            same_infos(given[name], value)
        elif value.dtype == object:
            for one, other in zip(given[name], value, strict=True):
                np.testing.assert_array_equal(one, other)
        else:
            np.testing.assert_allclose(given[name], value, rtol=1e-6, err_msg=name)
