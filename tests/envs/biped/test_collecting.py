"""Many steps under a policy: the same as stepping by hand, whatever the batch and the cores."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.envs import BipedEnv, collect
from stickslip.envs.functional import pure_step

ENV = BipedEnv()
PARAMS = ENV.make_params(scene="slippery", time_limit=0.2)
STEPS = 14


def policy(gain, obs, key):
    """Looks, and draws."""
    return jnp.clip(gain * (3 - obs[2:3]) + 0.1 * jax.random.normal(key, (1,)), -1, 1)


GAIN = jnp.float32(0.1)
ROUNDING = {"rtol": 1e-6, "atol": 1e-6}
"""Between two programs; see docs/performance.md."""


def collected(num_envs: int, steps: int = STEPS, gain=GAIN, **options):
    how = {"num_envs": num_envs, "steps": steps, "policy_params": gain}
    return collect(ENV, PARAMS, policy, 5, **how, **options)


@pytest.fixture(scope="module")
def few():
    return collected(6, keep=("obs", "action", "next_obs", "status"))


def test_each_step_is_the_environments_own(few):
    assert few.reward.shape == (STEPS, 6)
    assert few.kept["obs"].shape == (STEPS, 6, 6)
    again = jax.jit(jax.vmap(by_hand))
    now = collected_from_the_start(6)
    for row in range(STEPS):
        obs, state, keys, reward, over = again(*now, few.kept["action"][row])
        np.testing.assert_allclose(few.kept["obs"][row], now[0], **ROUNDING)
        np.testing.assert_allclose(few.reward[row], reward, atol=1e-6)
        np.testing.assert_array_equal(few.terminated[row] | few.truncated[row], over)
        now = (obs, state, keys)
    assert few.truncated.any()
    np.testing.assert_allclose(few.progress.obs, now[0], **ROUNDING)


def collected_from_the_start(num_envs: int):
    def one(index):
        chain, reset = jax.random.split(jax.random.fold_in(jax.random.key(5), index))
        return *ENV.reset_env(reset, PARAMS), jax.random.key_data(chain)

    return jax.jit(jax.vmap(one))(jnp.arange(num_envs))


def by_hand(obs, state, data, action):
    draws = jax.random.split(jax.random.wrap_key_data(data), 3)
    found = pure_step(ENV, draws[2], state, action, PARAMS)
    over = found[3] | found[4]
    return found[0], found[1], jax.random.key_data(draws[0]), found[2], over


def test_going_on_is_one_long_walk(few):
    half = collected(6, STEPS // 2)
    rest = collected(6, STEPS // 2, progress=half.progress)
    for wrong, said in ((half.progress, "6 environments; accepted: 5"), (3, "progress = 3")):
        with pytest.raises(ValueError, match=said):
            collected(5, 1, progress=wrong)
    both = jnp.concatenate([half.reward, rest.reward])
    np.testing.assert_allclose(both, few.reward, atol=2e-6)  # another program
    np.testing.assert_array_equal(rest.progress.keys, few.progress.keys)
    np.testing.assert_allclose(rest.progress.obs, few.progress.obs, atol=2e-5)


@pytest.mark.parametrize("cores", [1, 2, pytest.param(3, marks=pytest.mark.long)])
@pytest.mark.long
def test_cores_change_roundings_at_most(few, cores):
    again = collected(6, cores=cores)
    np.testing.assert_allclose(again.reward, few.reward, atol=2e-6)
    np.testing.assert_array_equal(again.terminated, few.terminated)


@pytest.mark.long
def test_inside_a_trace_it_is_one_program(few):
    traced = jax.jit(lambda gain: collected(6, gain=gain).reward)
    np.testing.assert_allclose(traced(GAIN), few.reward, atol=2e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"num_envs": 0}, "num_envs = 0"),
        ({"steps": 1.5}, "steps = 1.5"),
        ({"keep": ("sped",)}, "'sped' is no name to keep"),
        ({"num_envs": 10**9, "steps": 10**9}, "num_envs = 1000000000 with steps"),
        ({"policy": lambda p, obs, key: obs}, "action has shape"),
        ({"params": 3}, "params = 3"),
        ({"cores": 0}, "cores = 0"),
    ],
)
def test_nonsense_is_refused(changes, words):
    given = {"params": PARAMS, "policy": policy, "num_envs": 4, "steps": 2} | changes
    with pytest.raises(ValueError, match=words):
        collect(ENV, policy_params=GAIN, **given)
