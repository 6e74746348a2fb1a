"""The Gymnasium vector environment behaves like SyncVectorEnv over single ones."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from stickslip.envs import GymVectorEnv
from tests.envs.helpers import BIPED, make, make_vec
from tests.envs.toy import PARAMS, Toy, pushes, toys

MODES = list(AutoresetMode)


def test_make_vec_gives_the_batched_environment_its_mode_and_its_spec():
    for given in (AutoresetMode.DISABLED, AutoresetMode.DISABLED.value, "disabled"):
        assert toys(2, given).metadata["autoreset_mode"] is AutoresetMode.DISABLED
    env = make_vec(2, name="default")
    assert env.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    assert env.spec is not None
    assert env.spec.id == BIPED
    assert env.num_envs == 2
    assert env.observation_space.shape == (2, 6)
    assert env.single_action_space == make().action_space
    chosen = gymnasium.make_vec(BIPED, num_envs=2, autoreset_mode=AutoresetMode.SAME_STEP)
    assert isinstance(chosen.unwrapped, GymVectorEnv)
    assert chosen.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_nothing_that_was_returned_is_used_again():
    env = toys()
    first, _ = env.reset(seed=0)
    kept = first.copy()
    second = env.step(pushes(3, 0.1, 0.1, 0.1))
    copies = [second[i].copy() for i in range(4)]
    first[:] = 99.0
    third = env.step(pushes(3, 0.1, 0.1, 0.1))
    for i in range(4):
        assert np.array_equal(second[i], copies[i])
        assert not np.shares_memory(second[i], third[i])
        assert second[i].flags.writeable
    np.testing.assert_allclose(third[0][:, 0], kept[:, 0] + 0.06, atol=1e-6)


@pytest.mark.long
def test_vector_wrappers_of_gymnasium_work():
    env = NormalizeObservation(RecordEpisodeStatistics(make_vec(3, "next_step")))
    env.reset(seed=0)
    ended = 0
    for _ in range(35):
        obs, *_, infos = env.step(np.zeros((3, 1), np.float32))
        assert np.all(np.isfinite(obs))
        if "episode" in infos:
            done = infos["_episode"]
            ended += done.sum()
            own, seen = infos["episode_return"][done], infos["episode"]["r"][done]
            np.testing.assert_allclose(seen, own, rtol=1e-4)
            lengths = infos["episode_length"][done]
            assert np.array_equal(infos["episode"]["l"][done], lengths)
    assert ended >= 3


def test_a_picture_is_of_the_present_state_in_every_mode():
    for mode in MODES:
        env = GymVectorEnv(Toy("disabled"), PARAMS, 2, mode, render_mode="rgb_array")
        with pytest.raises(ValueError, match="render without an episode"):
            env.render()
        env.reset(seed=0)
        shades = []
        for step in range(1, PARAMS.limit + 2):
            if mode is AutoresetMode.DISABLED and step > PARAMS.limit:
                env.reset(options={"reset_mask": np.asarray([True, True])})
            else:
                env.step(pushes(2))
            shades.append([int(picture.max()) // 30 for picture in env.render() or ()])
        counts = [*range(1, PARAMS.limit + 1), 0]
        if mode is AutoresetMode.SAME_STEP:
            counts[-2:] = [0, 1]
        assert shades == [[count] * 2 for count in counts]


@pytest.mark.long
@pytest.mark.parametrize("name", ["Biped-v0", "UGVRough-v1"])
def test_max_episode_steps_truncates_a_vector(name):
    limits = {"autoreset_mode": "same_step", "max_episode_steps": 7}
    envs = gymnasium.make_vec(f"stickslip/{name}", num_envs=2, **limits)
    envs.reset(seed=0)
    nothing = np.zeros(envs.action_space.shape, np.float32)
    truncated = [envs.step(nothing)[3].all() for _ in range(14)]
    assert np.flatnonzero(truncated).tolist() == [6, 13]
