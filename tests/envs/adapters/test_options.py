"""Options of a reset in every adapter: a start for the episodes that begin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.checks import require_known
from stickslip.dynamics.pytrees import require_one
from stickslip.envs import GymEnv, GymVectorEnv
from tests.envs.toy import Toy
from tests.extras import SB3

COUNT = 4
STEPS = 40


class PushedParams(NamedTuple):
    """start: where every episode begins, or None to draw it."""

    control_period: Any = 0.1
    limit: Any = 7
    start: Any = None


@dataclass(frozen=True)
class Pushed(Toy):
    """The toy with a start that only a reset reads."""

    option_names = ("start",)

    def episode_params(self, params, options):
        require_known(options, self.option_names, "option of reset")
        start = require_one("start", options["start"], accepted="a finite number")
        return params._replace(start=start)

    def reset_env(self, key, params):
        obs, state = super().reset_env(key, params)
        if params.start is not None:
            state = state._replace(place=jnp.asarray(params.start, state.place.dtype))
            obs = self._observe(state)
        return obs, state


PARAMS = PushedParams()
OPTIONS: list[dict[str, float]] = [{}, {"start": 0.25}, {"start": -0.75}]


class Single:
    """One environment by hand: the functional one, and the chain of keys that PackedEnvs has."""

    def __init__(self, seed: int):
        self.env, self.key = Pushed("disabled"), jax.random.key(seed)

    def reset(self, options: dict[str, float] | None = None) -> np.ndarray:
        self.params = self.env.episode_params(PARAMS, options) if options else PARAMS
        self.key, key = jax.random.split(self.key)
        obs, self.state = self.env.reset(key, self.params)
        return np.asarray(obs)

    def step(self, action: np.ndarray) -> tuple[Any, ...]:
        obs, self.state, *rest = self.env.step(self.key, self.state, action, self.params)
        return np.asarray(obs), *map(np.asarray, rest[:3]), rest[3]


def close(given: Any, expected: Any) -> None:
    np.testing.assert_allclose(given, expected, rtol=1e-6, atol=1e-6)


def pushes(random: np.random.Generator) -> np.ndarray:
    return random.uniform(-1, 1, (COUNT, 2)).astype(np.float32)


@pytest.mark.parametrize("mode", ["same_step", "next_step", "disabled"])
def test_a_batch_with_options_is_as_many_single_environments(mode):
    random = np.random.default_rng(5)
    env = GymVectorEnv(Pushed("disabled"), PARAMS, COUNT, mode)
    singles = [Single(seed) for seed in range(COUNT)]
    obs, _ = env.reset(seed=0, options=OPTIONS[1])
    close(obs, [one.reset(OPTIONS[1]) for one in singles])
    over, ended = np.zeros(COUNT, bool), 0
    for step in range(STEPS):
        if step % 9 == 8 or (mode == "disabled" and over.any()):
            mask = np.ones(COUNT, bool)
            options: Any = OPTIONS[random.integers(len(OPTIONS))]
            if mode == "disabled" and step % 2:
                mask = over | (np.arange(COUNT) == step % COUNT)
            obs, _ = env.reset(options=options | {"reset_mask": mask})
            for i in map(int, np.flatnonzero(mask)):
                close(obs[i], singles[i].reset(options))
            over = over & ~mask
        actions = pushes(random)
        obs, reward, terminated, truncated, infos = env.step(actions)
        for i, one in enumerate(singles):
            if mode == "next_step" and over[i]:
                close(obs[i], one.reset())
                assert (reward[i], terminated[i], truncated[i]) == (0, False, False)
                over[i] = False
                continue
            expected = one.step(actions[i])
            over[i] = ends = bool(expected[2] | expected[3])
            close(reward[i], expected[1])
            assert (terminated[i], truncated[i]) == tuple(map(bool, expected[2:4]))
            ended += ends
            if ends and mode == "same_step":
                close(infos["final_obs"][i], expected[0])
                close(infos["final_info"]["episode_return"][i], expected[4]["episode_return"])
                close(obs[i], one.reset())
                over[i] = False
            else:
                close(obs[i], expected[0])
                close(infos["episode_length"][i], expected[4]["episode_length"])
    assert ended > 2 * COUNT


@pytest.mark.parametrize("options", OPTIONS)
def test_options_hold_for_one_episode(options):
    env, other = (GymEnv(Pushed("disabled"), PARAMS) for _ in range(2))
    first, single = env.reset(seed=3, options=options)[0], Single(3)
    close(first, single.reset(options))
    action = np.full(2, 0.25, np.float32)
    close(env.step(action)[0], single.step(action)[0])
    other.reset(seed=3)
    for _ in range(2):
        assert np.array_equal(env.reset()[0], other.reset()[0])
        assert np.array_equal(env.step(action)[0], other.step(action)[0])


@SB3
def test_stable_baselines3_gives_options_to_all_environments():
    from stickslip.envs import SB3VecEnv

    env = SB3VecEnv(Pushed("same_step"), PARAMS, COUNT)
    singles = [Single(seed) for seed in range(COUNT)]
    for given in (OPTIONS[1], {}, OPTIONS[2]):
        env.set_options(given)
        close(env.reset(), [one.reset(given) for one in singles])
        for _ in range(3):
            obs, reward, done, infos = env.step(np.full((COUNT, 2), 0.1, np.float32))
            for i, one in enumerate(singles):
                expected = one.step(np.full(2, 0.1, np.float32))
                close(reward[i], expected[1])
                assert done[i] == bool(expected[2] | expected[3])
                if done[i]:
                    close(infos[i]["terminal_observation"], expected[0])
                close(obs[i], one.reset() if done[i] else expected[0])
    env.set_options([*OPTIONS, {}])
    with pytest.raises(ValueError, match="options differ; accepted: a dict"):
        env.reset()
    env.reset()
    for few in ([], OPTIONS[:1]):
        env.set_options(few)
        with pytest.raises(ValueError, match=f"{len(few)} options; accepted: {COUNT}, or a dict"):
            env.reset()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"strat": 1.0}, r"'strat' is no option of reset; accepted: .*did you mean start\?"),
        ({"start": np.nan}, r"start = nan is not accepted; accepted: a finite number"),
        (["start"], r"options = \['start'\]; accepted: None or a dict"),
    ],
)
def test_bad_options_are_refused_and_the_episode_goes_on(options, message):
    for env, shape in (
        (GymEnv(Pushed("disabled"), PARAMS), (2,)),
        (GymVectorEnv(Pushed("disabled"), PARAMS, COUNT), (COUNT, 2)),
    ):
        first, _ = env.reset(seed=0)
        with pytest.raises(ValueError, match=message):
            env.reset(seed=9, options=options)
        obs, *_ = env.step(np.zeros(shape, np.float32))
        assert np.array_equal(obs[..., 0], first[..., 0])
