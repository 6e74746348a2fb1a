"""The Gymnasium environment keeps Gymnasium's contract."""

from __future__ import annotations

import copy
import os
import pickle
import warnings
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import RecordEpisodeStatistics, RescaleAction, TimeAwareObservation

from stickslip.dynamics import pytrees
from stickslip.envs import BipedEnv, GymEnv, UGVEnv
from stickslip.envs.adapters.packed import Shared
from stickslip.envs.functional import horizon
from tests.envs.helpers import BIPED, make
from tests.envs.toy import one_toy
from tests.envs.ugv import helpers as ugv

STILL = np.zeros(1, np.float32)


UGV = [pytest.param(ugv.make, name, marks=pytest.mark.long) for name in ("short", "random")]


@pytest.mark.parametrize(("build", "name"), [(make, "default"), (make, "random"), *UGV])
def test_check_env_finds_nothing_to_complain_about(build, name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(build(name), skip_render_check=True)


def test_flags_are_python_bools_and_numbers_python_numbers():
    env = make()
    obs, info = env.reset(seed=0)
    assert type(obs) is np.ndarray
    assert info == {}
    obs, reward, terminated, truncated, info = env.step(STILL)
    assert obs.dtype == np.float32
    assert [type(one) for one in (reward, terminated, truncated)] == [float, bool, bool]
    assert {type(value) for value in info.values()} == {int, float}
    assert type(info["status"]) is type(info["episode_length"]) is int
    assert all(isinstance(name, str) for name in info)


def test_nothing_that_was_returned_is_used_again():
    env = one_toy()
    first, first_info = env.reset(seed=0)
    kept = first.copy()
    action = np.asarray([0.5, 0.0], np.float32)
    second, *_, info = env.step(action)
    remembered = (second.copy(), dict(info))
    assert second.flags.writeable
    first[:], second[:] = 99.0, 99.0
    info["place"] = 99.0
    first_info["place"] = 99.0
    third, *_, third_info = env.step(action)
    assert third[0] == pytest.approx(kept[0] + 0.3, abs=1e-6)
    assert third_info["place"] == pytest.approx(third[0])
    assert np.array_equal(action, [0.5, 0.0])
    assert remembered[0][0] == pytest.approx(kept[0] + 0.15, abs=1e-6)


def episodes(env: gymnasium.Env, count: int, **reset: Any) -> list:
    """First observations of `count` resets, seeded the first time."""
    return [env.reset(**(reset if i == 0 else {}))[0][0] for i in range(count)]


def test_a_seed_fixes_the_whole_sequence_of_episodes():
    assert episodes(one_toy(), 4, seed=5) == episodes(one_toy(), 4, seed=5)
    assert len(set(episodes(one_toy(), 4, seed=5))) == 4
    assert set(episodes(one_toy(), 4, seed=5)).isdisjoint(episodes(one_toy(), 4, seed=6))
    env = one_toy()
    assert episodes(env, 3, seed=5) == episodes(env, 3, seed=5)


def test_stepping_outside_an_episode_is_refused():
    env = one_toy()
    with pytest.raises(ValueError, match=r"step without an episode; accepted: after reset"):
        env.step(np.zeros(2))
    env.reset(seed=0)
    over = False
    while not over:
        *_, terminated, truncated, _ = env.step(np.zeros(2))
        over = terminated or truncated
    assert truncated
    with pytest.raises(ValueError, match=r"ended \(truncated after 7 steps\); accepted: reset"):
        env.step(np.zeros(2))
    env.reset()
    env.step(np.zeros(2))


def test_the_core_must_leave_resetting_to_the_user():
    with pytest.raises(ValueError, match=r"autoreset = 'same_step'; accepted: 'disabled'"):
        GymEnv(BipedEnv(), BipedEnv().default_params)
    for build in (make, ugv.make):
        with pytest.raises(ValueError, match=r"autoreset = 'next_step'; accepted: 'disabled'"):
            build(autoreset="next_step")


@pytest.mark.parametrize(
    ("name", "choices"),
    [
        (BIPED, {"mean_rate": 2.5, "see_friction": True}),
        pytest.param(ugv.UGV, {"criterion": "grip", "preview": 0}, marks=pytest.mark.long),
    ],
)
def test_the_spec_makes_the_same_environment_again(name, choices):
    env = gymnasium.make(name, **choices)
    assert env.spec is not None
    again = gymnasium.make(env.spec)
    assert again.unwrapped.functional == env.unwrapped.functional  # type: ignore[attr-defined]
    first, second = env.reset(seed=3)[0], again.reset(seed=3)[0]
    assert np.array_equal(first, second)
    kept = gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json())
    assert gymnasium.make(kept).reset(seed=3)[0] == pytest.approx(first)


@pytest.mark.parametrize("options", [{}, {"time_limit": 20.0}, {"control_period": 0.04}])
def test_the_spec_says_how_long_an_episode_is(options):
    """Also where the parameters change it; the wrapper of TimeLimit alone makes it shorter."""
    steps = {"time_limit": 1000, "control_period": 250}.get(next(iter(options), ""), 500)
    env = gymnasium.make(BIPED, **options)
    assert env.spec.max_episode_steps == steps
    assert TimeAwareObservation(env).max_timesteps == steps
    assert gymnasium.make(BIPED, **options, max_episode_steps=7).spec.max_episode_steps == 7
    assert "TimeLimit" not in str(env)
    for given, want in ((7, 7), (-1, steps), (10**6, steps)):
        envs = gymnasium.make_vec(BIPED, num_envs=2, **options, max_episode_steps=given)
        assert envs.spec.max_episode_steps == want
    with pytest.raises(ValueError, match=r"max_episode_steps = 0; accepted: an integer >= 1"):
        gymnasium.make_vec(BIPED, num_envs=2, max_episode_steps=0)


def test_an_episode_of_some_periods_and_a_half_is_as_long_as_its_spec():
    env = gymnasium.make(BIPED, time_limit=0.55)
    env.reset(seed=np.int64(0))
    taken = next(n for n in range(1, 99) if any(env.step([0.0])[2:4]))
    assert taken == env.spec.max_episode_steps == 27


def test_a_shorter_drive_costs_a_failure_as_much():
    params = UGVEnv().make_params()
    short = params.shortened(7)
    assert (horizon(params), horizon(short)) == (66, 7)
    assert float(short.failure_penalty) == float(params.failure_penalty)


def test_gymnasiums_wrappers_work():
    env = RecordEpisodeStatistics(RescaleAction(make("random"), np.float32(0), np.float32(1)))
    env.reset(seed=0)
    total, info = 0.0, {}
    for _ in range(40):
        _, reward, terminated, truncated, info = env.step(np.asarray([0.5], np.float32))
        total += float(reward)
        if terminated or truncated:
            break
    assert info["episode"]["r"] == pytest.approx(total)
    assert info["episode"]["r"] == pytest.approx(info["episode_return"], rel=1e-4)
    assert info["episode"]["l"] == info["episode_length"]


def test_parameters_are_kept_without_their_hash():
    """Strings hash differently in every process: a stale hash would compile the same step again."""
    shared = Shared(BipedEnv().make_params())
    kept = pickle.dumps(shared)
    assert b"_hash" not in kept
    assert pickle.loads(kept) == copy.deepcopy(shared) == shared


@pytest.mark.parametrize("name", ["Biped-v0", "UGV-v0", "BipedIce-v0"])
def test_environments_after_a_fork_are_refused_where_they_would_hang(monkeypatch, name):
    """As in a process that was forked after JAX had run in this one."""
    monkeypatch.setattr(pytrees, "_MADE_IN", os.getpid() + 1)
    monkeypatch.setattr(pytrees, "_jax_ran", True)
    for make_it in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(RuntimeError, match=r"forked.*accepted: .*context=\"spawn\""):
            make_it(f"stickslip/{name}")
