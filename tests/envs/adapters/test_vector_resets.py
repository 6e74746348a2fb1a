"""Seeds, resets and refusals of the Gymnasium vector environment."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from stickslip.envs import GymVectorEnv
from tests.envs.helpers import make_vec
from tests.envs.toy import PARAMS, one_toy, pushes, toys


def firsts(env: GymVectorEnv, **reset: Any) -> list[float]:
    return env.reset(**reset)[0][:, 0].tolist()


def test_seed_s_means_seeds_s_to_s_plus_n():
    singles = [one_toy().reset(seed=20 + i)[0][0] for i in range(3)]
    assert firsts(toys(), seed=20) == singles
    assert firsts(toys(), seed=[20, 21, 22]) == singles  # type: ignore[arg-type]
    assert firsts(toys(), seed=[22, 20, 21]) == [singles[2], *singles[:2]]  # type: ignore[arg-type]
    assert firsts(toys(5), seed=20)[:3] == singles


def test_none_in_a_list_of_seeds_goes_on_in_its_chain():
    env, other = toys(), toys()
    env.reset(seed=1)
    other.reset(seed=1)
    mixed = firsts(env, seed=[None, 50, None])
    plain = firsts(other)
    assert mixed[0] == plain[0]
    assert mixed[2] == plain[2]
    assert mixed[1] == firsts(toys(), seed=49)[1]


def test_a_masked_reset_with_a_seed_seeds_only_where_asked():
    env = toys(3, AutoresetMode.DISABLED)
    env.reset(seed=0)
    mask = {"reset_mask": np.asarray([True, False, False])}
    obs, _ = env.reset(seed=7, options=mask)
    at_first, _ = toys(3, AutoresetMode.DISABLED).reset(seed=7, options=mask)
    assert obs[0, 0] == at_first[0, 0] == one_toy().reset(seed=7)[0][0]
    following = firsts(env)
    other = toys()
    other.reset(seed=0)
    assert following[1:] == firsts(other)[1:]


def test_without_autoreset_a_finished_environment_must_be_reset_first():
    env = toys(2, AutoresetMode.DISABLED)
    env.reset(seed=0)
    for _ in range(PARAMS.limit):
        obs, *_, truncated, _ = env.step(pushes(2))
    assert truncated.all()
    assert obs[:, 1].tolist() == [PARAMS.limit] * 2
    with pytest.raises(ValueError, match=r"environments \[0, 1\] of 2 have ended.*accepted: reset"):
        env.step(pushes(2))
    env.reset(options={"reset_mask": np.asarray([True, False])})
    with pytest.raises(ValueError, match=r"\[1\] of 2 .*first: truncated after 7 steps"):
        env.step(pushes(2))
    env.reset()
    env.step(pushes(2))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: toys(0), r"num_envs = 0; accepted: an integer >= 1"),
        (
            lambda: toys(2, "sometimes"),
            r"autoreset_mode = 'sometimes' is unknown; accepted: .*'next_step'",
        ),
        (
            lambda: make_vec(2, render_mode="human"),
            r"render_mode = 'human' is unknown; accepted: None",
        ),
        (lambda: make_vec(2, autoreset="same_step"), r"autoreset = 'same_step'; .*autoreset_mode"),
        (lambda: toys().step(pushes(3)), r"step without an episode; accepted: after reset"),
    ],
)
def test_bad_requests_are_refused_with_what_is_accepted(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reset_mask": np.asarray([1, 0, 1])}, r"type int64; accepted: booleans \[3\]"),
        ({"reset_mask": np.asarray([True, False])}, r"shape \(2,\).*accepted: booleans \[3\]"),
        ({"reset_mask": np.zeros(3, bool)}, r"at least one true"),
        ({"mask": 1}, r"'mask' is no option of reset; accepted: reset_mask"),
    ],
)
def test_bad_options_of_reset_are_refused(options, message):
    env = toys()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)


@pytest.mark.parametrize("seed", [[1, "a", 2], [1, -1, 2], 0.5, 2**64])
def test_seeds_that_are_none_are_refused_by_name(seed):
    with pytest.raises(ValueError, match=r"seed = .*accepted: "):
        toys().reset(seed=seed)


def test_seeds_beyond_32_bits_count_modulo_their_range():
    first, other, again = firsts(toys(), seed=[7, 8, 2**32 + 7])
    assert first == again != other
    assert one_toy().reset(seed=2**63 + 7)[0][0] == first


def test_the_mode_is_told_where_gymnasiums_own_environments_tell_it():
    assert make_vec(1, "disabled").autoreset_mode is AutoresetMode.DISABLED
