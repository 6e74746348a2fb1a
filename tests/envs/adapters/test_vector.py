"""The Gymnasium vector environment behaves like SyncVectorEnv over single ones."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from stickslip.envs import BipedEnv, GymVectorEnv
from tests.envs.helpers import BIPED, make, make_vec
from tests.envs.same_as_single import check_vector_env
from tests.envs.toy import PARAMS, Toy, one_toy, pushes, toys

MODES = list(AutoresetMode)


@pytest.mark.long  # test_same_episode.py beside it takes fewer steps of the same
@pytest.mark.parametrize("mode", MODES)
def test_bipeds_in_one_call_do_what_single_bipeds_do(mode):
    env = make_vec(3, mode)
    assert check_vector_env(env, lambda: make("random"), steps=80, scale=0.3, atol=2e-3) >= 5


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("count", [1, 4])
def test_toys_in_one_call_do_what_single_toys_do(mode, count):
    assert check_vector_env(toys(count, mode), one_toy, steps=100, seed=9) >= 10 * count


@pytest.mark.parametrize("mode", MODES)
def test_the_mode_is_told_as_the_enum(mode):
    for given in (mode, mode.value, {AutoresetMode.NEXT_STEP: "next_step"}.get(mode, mode)):
        env = toys(2, given)
        assert env.metadata["autoreset_mode"] is mode


def test_make_vec_gives_the_batched_environment_and_keeps_its_spec():
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


def test_shapes_and_types_are_those_of_gymnasium():
    env = toys()
    obs, info = env.reset(seed=0)
    assert info == {}
    assert env.observation_space.contains(obs)
    obs, reward, terminated, truncated, info = env.step(pushes(3))
    assert env.observation_space.contains(obs)
    assert (reward.shape, reward.dtype) == ((3,), np.float64)
    for flag in (terminated, truncated):
        assert (flag.shape, flag.dtype) == ((3,), np.bool_)
    assert info["right"].dtype == bool
    assert np.issubdtype(info["episode_length"].dtype, np.integer)


@pytest.mark.parametrize("mode", MODES)
def test_one_finished_environment_does_not_stop_the_others(mode):
    env = toys(3, mode)
    start = env.reset(seed=0)[0][:, 0]
    actions = pushes(3, np.sign(start[0]))
    ends = np.zeros(3, bool)
    steps = 0
    while not ends.any():
        obs, _, terminated, truncated, _ = env.step(actions)
        ends, steps = terminated | truncated, steps + 1
    assert ends.tolist() == [True, False, False]
    if mode is AutoresetMode.DISABLED:
        env.reset(options={"reset_mask": ends})
    obs, *_ = env.step(pushes(3, 0, 0.1, 0.2))
    assert obs[1:, 1].tolist() == [steps + 1, steps + 1]
    np.testing.assert_allclose(obs[1:, 0], start[1:] + np.asarray([0.03, 0.06]), atol=1e-6)
    assert obs[0, 1] == (0 if mode is AutoresetMode.NEXT_STEP else 1)


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
            np.testing.assert_allclose(
                infos["episode"]["r"][done], infos["episode_return"][done], rtol=1e-4
            )
            lengths = infos["episode_length"][done]
            assert np.array_equal(infos["episode"]["l"][done], lengths)
    assert ended >= 3


def test_pictures_come_one_for_each_environment():
    pytest.importorskip("matplotlib")
    env = make_vec(2, "next_step", render_mode="rgb_array")
    with pytest.raises(ValueError, match="render without an episode"):
        env.render()
    env.reset(seed=0)
    pictures = env.render()
    assert pictures is not None
    assert len(pictures) == 2
    assert pictures[0].shape == pictures[1].shape
    assert not np.array_equal(*pictures)
    assert toys().render() is None


def test_a_picture_is_of_the_present_state_in_every_mode():
    for mode in MODES:
        env = GymVectorEnv(Toy("disabled"), PARAMS, 2, mode, render_mode="rgb_array")
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


def test_the_core_is_told_the_mode():
    for mode, name in zip(MODES, ("NextStep", "SameStep", "Disabled"), strict=True):
        assert mode.value == name
        kinds = {"NextStep": "next_step", "SameStep": "same_step", "Disabled": "disabled"}
        env = GymVectorEnv(BipedEnv(), BipedEnv().default_params, 1, name)
        assert env.functional.autoreset == kinds[name]
