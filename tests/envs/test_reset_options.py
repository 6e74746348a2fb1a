"""What options of a reset make of an episode of either machine."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from stickslip.envs import BipedEnv, GymEnv, Randomisation, RandomTrack, UGVEnv, UGVRandomisation
from tests.envs.helpers import RANGES, make, task, warm_then_count
from tests.trees import assert_same


def episode(env: GymEnv, options: dict[str, Any] | None = None, seed: int = 4) -> list[np.ndarray]:
    """Observations, and rewards and infos, of an episode's first steps."""
    seen, told = [env.reset(seed=seed, options=options)[0]], []
    random = np.random.default_rng(1)
    for _ in range(25):
        action = random.uniform(-0.1, 0.3, env.action_space.shape).astype(np.float32)
        obs, reward, terminated, truncated, info = env.step(action)
        seen.append(obs)
        told.append([reward, *info.values()])
        if terminated or truncated:
            break
    return [np.asarray(seen), np.asarray(told, float)]


def test_the_bipeds_start_is_bit_by_bit_that_of_parameters_with_it():
    options = {"phase": 4.0, "crank_rate": 2.0, "mean_rate": 2.5}
    drawn = Randomisation(**{one: (value, value) for one, value in options.items()})
    # The same steps: only the reset differs, which is compiled with these numbers or passed them.
    made = episode(GymEnv(BipedEnv(autoreset="disabled"), task()[1].replace(randomisation=drawn)))
    given = episode(make(), options)
    assert len(given[0]) > 10
    for one, other in zip(given, made, strict=True):
        assert np.array_equal(one, other)


def test_parameters_of_an_episode_are_what_make_params_gives():
    env = BipedEnv()
    params = env.make_params(randomisation=RANGES)
    options = {"phase": 2.0, "crank_rate": 1.0, "mean_rate": 2.0}
    starts = {name: (value, value) for name, value in options.items()}
    made = env.make_params(randomisation=replace(RANGES, **starts))
    assert_same(env.episode_params(params, options), made)
    assert_same(params, env.make_params(randomisation=RANGES))


GROUND = UGVRandomisation(RandomTrack((0.0, 0.1)), (0.5, 0.9), (1.0, 2.0))


@pytest.mark.parametrize("before", [UGVRandomisation(), GROUND])
def test_parameters_of_a_drive_are_what_make_params_gives(before):
    env = UGVEnv()
    given = env.episode_params(env.make_params(randomisation=before), {"start_angles": (1.5, 1.7)})
    drawn = UGVRandomisation(before.track, before.friction)
    assert_same(given, env.make_params(start_angles=(1.5, 1.7), randomisation=drawn))


def test_other_numbers_of_a_bipeds_start_compile_nothing():
    env = make()

    def use(turn: int) -> None:
        env.reset(seed=turn, options={"phase": 2.0 + 0.1 * turn})
        env.step(np.full(1, 0.1, np.float32))
        env.reset(options={"crank_rate": 0.1 * turn, "mean_rate": 2.0 + turn})
        env.reset()

    assert warm_then_count(use) == 0


BAD: list[tuple[Any, str]] = [
    ({"phas": 2.0}, r"'phas' is no option of reset; accepted: phase, .*did you mean phase\?"),
    ({"scene": "firm"}, r"'scene' is no option of reset; accepted: phase, "),
    ({"mark": 1.0}, r"mark is drawn in a task without one"),
    ({"phase": 0.1}, r"phase = 0\.1 is not accepted; accepted: an angle within pi/2 to 3 pi/2"),
    ({"phase": np.nan}, r"phase = nan is not accepted"),
    ({"phase": [2.0, 3.0]}, r"phase has shape \(2,\).*one number"),
]


@pytest.mark.parametrize(("options", "message"), BAD)
def test_bad_options_of_the_biped_are_refused(options, message):
    env = make()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"track": "bump"}, r"'track' is no option of reset; accepted: start_angles"),
        ({"start_angles": (np.nan, 1.5)}, r"start_angles = nan"),
        ({"start_angles": [[1.5, 1.5]]}, r"start_angles has shape \(1, 2\); accepted: two"),
    ],
)
def test_bad_options_of_the_ugv_are_refused(options, message):
    env = UGVEnv()
    params = env.default_params
    with pytest.raises(ValueError, match=message):
        env.episode_params(params, options)
