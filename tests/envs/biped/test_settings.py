"""Speed against accuracy in the environment, both precisions, and parameters of each walker."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import stickslip  # noqa: F401
from stickslip.dynamics import Scene, Setting
from stickslip.dynamics.biped import BipedParams, EventExact, RK4Split
from stickslip.envs import BipedEnv
from tests.envs.helpers import actions, rollout, task

pytestmark = pytest.mark.long

FINE = Setting("table", "event_exact", 0.02, "float64")


def after_thirty_steps(env: BipedEnv, **options) -> np.ndarray:
    """Crank angle and slide after 30 control steps of a varying torque."""
    params = env.make_params(**options)
    reset, step = jax.jit(env.reset), jax.jit(env.step)
    _, state = reset(jax.random.key(3), params)
    for i in range(30):
        action = jnp.asarray([0.1 * np.sin(i / 5)], state.biped.phase.dtype)
        _, state, _, over, *_ = step(jax.random.key(i), state, action, params)
        assert not bool(over)
    return np.array([float(state.biped.crank_angle), float(state.biped.foot_position)])


def test_finer_settings_come_closer_to_the_finest(float64):
    exact = after_thirty_steps(BipedEnv(setting=FINE))
    missed = [
        np.abs(after_thirty_steps(BipedEnv(setting=setting), dtype="float64") - exact).max()
        for setting in (Setting("table", "euler", 0.02), Setting("table", "rk4_split", 0.005))
    ]
    assert missed[1] < 1e-5 < missed[0]


def test_dt_is_the_longest_step_in_a_control_period():
    assert BipedEnv(setting=Setting("table", "rk4_split", 0.006)).integrator.substeps == 4
    assert BipedEnv(setting=FINE).integrator == EventExact()
    assert BipedEnv().integrator == RK4Split(1, 3)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: BipedEnv(setting="quick"), ("setting", "'quick'", "'fast'", "'exact'")),
        (lambda: BipedEnv(setting="fast", substeps=2), ("setting", "substeps", "2", "alone")),
        (lambda: BipedEnv(setting=FINE).make_params(), ("float64", "jax_enable_x64")),
    ],
)
def test_wrong_settings_are_refused_by_name(make, words):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        make()
    assert all(word in str(caught.value) for word in words)


def test_every_walker_of_a_batch_can_have_its_own_parameters(float64):
    env, _ = task(dtype="float64")
    friction, rate = [0.04, 0.06, 0.3, 0.9], [2.0, 3.0, 3.5, 5.0]
    payload, density = [0.0, 0.5, 1.0, 0.2], [1.48, 1.2, 1.8, 1.48]

    def build(mu, mean_rate, extra, bar_density):
        biped = BipedParams.from_bars(bar_density=bar_density, payload=extra, dtype=jnp.float64)
        scene = Scene.uniform(mu, 0.8 * mu)
        return env.make_params(robot=biped, scene=scene, mean_rate=mean_rate)

    columns = [friction, rate, payload, density]
    batch = jax.jit(jax.vmap(build))(*map(jnp.asarray, columns))
    given = actions(0.2)
    run = rollout(env, batch, given, axis=0)
    seen = []
    for i, numbers in enumerate(zip(*columns, strict=True)):
        alone = rollout(env, build(*numbers), given)
        for name in ("obs", "reward", "terminated"):
            ours, theirs = getattr(run, name)[i], getattr(alone, name)[i]
            np.testing.assert_allclose(ours, theirs, atol=1e-7, err_msg=name)
        seen.append(alone.info["slid"][i].sum())
    assert seen[0] > seen[1] > seen[2]
