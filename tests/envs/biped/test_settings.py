"""Speed against accuracy in the environment: presets, settings, and what is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import stickslip  # noqa: F401
from stickslip.dynamics import Scene, Setting
from stickslip.dynamics.biped import EventExact, RK4Split
from stickslip.envs import BipedEnv, Randomisation

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
        for setting in (Setting("table", "rk4", 0.02), Setting("table", "rk4_split", 0.005))
    ]
    assert missed[1] < 1e-5 < missed[0]


def test_dt_is_the_longest_step_in_a_control_period():
    assert BipedEnv(setting=Setting("table", "rk4_split", 0.006)).integrator.substeps == 4
    assert BipedEnv(setting=Setting("table", "rk4_split", 0.005)).integrator.substeps == 4
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


def test_a_smoothed_floor_is_walked_on_and_seen():
    env = BipedEnv(see_friction=True)
    scene = Scene.smoothed(0.05, 0.02)
    params = env.make_params(scene=scene, randomisation=Randomisation(friction=(2.0, 2.0)))
    key = jax.random.key(0)
    observation, state = jax.jit(env.reset)(key, params)
    assert observation[-2:] == pytest.approx(0.1)
    _, state, _, over, _, info = jax.jit(env.step)(key, state, jnp.asarray([0.1]), params)
    assert not bool(over)
    assert float(state.biped.foot_velocity) != 0  # it creeps: nothing holds it
    assert env.picture(state, jax.tree.map(np.asarray, info), params).mu_kinetic == pytest.approx(
        0.1
    )
