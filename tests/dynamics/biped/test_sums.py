"""Long sums: the clock of a walk, and compensated totals, in single precision."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, RK4Split, Setting, simulate
from stickslip.dynamics.kernels.fused import fused
from stickslip.dynamics.pytrees import clock, compensated
from stickslip.envs import BipedEnv
from tests.dynamics.biped.helpers import default_model

COUNT = 10_000
HALF = np.finfo(np.float32).eps / 2
"""The most that rounding to float32 changes a number by, as a share of it."""


def steps_of(length: float, start: float, function) -> np.ndarray:
    body = partial(jax.lax.fori_loop, 0, COUNT, lambda _, now: function(now, jnp.float32(length)))
    return np.asarray(jax.jit(body)(jnp.float32(start)))


@pytest.mark.parametrize("length", [0.02, 0.0123, 0.1, 1 / 3])
def test_a_clock_ends_where_its_number_of_steps_says(length):
    exact = COUNT * np.float64(np.float32(length))
    for function in (clock, fused(clock)):
        assert abs(steps_of(length, 0.0, function) - exact) <= HALF * exact
    assert abs(steps_of(length, 0.0, jnp.add) - exact) > 100 * HALF * exact


def test_a_clock_adds_up_what_is_no_number_of_steps():
    times = jnp.asarray([0.013, 0.02, 1e5, -0.04, 0.0], jnp.float32)
    steps = jnp.asarray([0.02, 0.013, 1e-3, 0.02, jnp.inf], jnp.float32)
    np.testing.assert_array_equal(jax.vmap(clock)(times, steps), times + steps)
    assert jax.grad(clock, (0, 1))(jnp.float32(0.4), jnp.float32(0.02)) == (1.0, 1.0)


def test_compensated_sums_are_good_to_a_rounding_of_their_own():
    terms = np.random.default_rng(0).uniform(-1, 2, (COUNT, 3)).astype(np.float32)
    terms[:, 1] = np.float32(0.1)

    def body(now, term):
        return fused(compensated)(*now, term * term), None  # it may be fused with the sum

    zero = jnp.zeros(3, jnp.float32)
    (sums, _), _ = jax.jit(lambda: jax.lax.scan(jax.vmap(body), (zero, zero), terms))()
    exact = np.sum(terms.astype(np.float64) ** 2, axis=0)
    np.testing.assert_allclose(sums, exact, rtol=2 * HALF)
    assert np.any(abs(np.cumsum(terms**2, axis=0)[-1] - exact) > 20 * HALF * exact)
    assert compensated(jnp.inf, 0.0, 1.0) == (jnp.inf, 0.0)


@pytest.mark.parametrize("start", [0.0, 0.013])
def test_a_walk_of_200_seconds_takes_200_seconds(start):
    scene = replace(Scene.grip(), outputs="state")
    model, state = default_model(dtype="float32"), BipedState(crank_rate=3.0, time=start)
    feeble = (lambda now: 1e-6 * now.time), 200.0, 0.02
    walk = simulate(model, scene, state, *feeble, integrator="euler")
    assert int(walk.status) == 0
    assert walk.final.time.dtype == np.float32
    exact = start + np.arange(COUNT + 1) * np.float64(np.float32(0.02))
    np.testing.assert_allclose(walk.states.time, exact, rtol=3 * HALF)
    np.testing.assert_allclose(walk.torques, 1e-6 * exact[:-1], rtol=6 * HALF)


@pytest.mark.long
def test_an_episode_of_200_seconds_loses_nothing_in_its_totals():
    env = BipedEnv(setting=Setting(integrator=RK4Split()), autoreset="disabled")
    robot = BipedParams.from_bars(heel=1e6, toe=1e6, dtype=np.float32)
    params = env.make_params(robot=robot, time_limit=1e6)

    @jax.jit
    def run():
        def body(state, _):
            action = jnp.clip((4.0 - state.biped.crank_rate[None]) / 4, -1, 1)
            _, after, reward, terminated, _, info = env.step_env(state, action, params)
            names = ("walked", "slid", "positive_work", "copper_loss")
            return after, (reward, *(info[name] for name in names), terminated)

        return jax.lax.scan(body, env.reset_env(jax.random.key(0), params)[1], length=COUNT)

    state, (*terms, terminated) = run()
    assert not np.any(terminated)
    reward, walked, slid, work, loss = (np.sum(np.asarray(t, np.float64)) for t in terms)
    totals = state.totals
    np.testing.assert_allclose(state.biped.time, COUNT * np.float32(0.02), rtol=2 * HALF)
    found = (totals.reward, totals.walked, totals.slid)
    np.testing.assert_allclose(found, (reward, walked, slid), rtol=2 * HALF)
    np.testing.assert_allclose(totals.energy, work + loss, rtol=1e-6)  # rounded once a step
    turned = float(state.biped.phase) + np.pi * int(state.biped.steps) - np.pi / 2
    np.testing.assert_allclose(totals.turned, turned, rtol=1e-6)
