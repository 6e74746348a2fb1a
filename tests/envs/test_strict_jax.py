"""What large code bases of JAX set: no promotion of ranks or types, no transfer unasked for."""

from contextlib import ExitStack

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, step
from stickslip.envs import BipedEnv, UGVEnv
from stickslip.envs.tasks.definition import TASKS


@pytest.fixture(autouse=True)
def _no_promotion():
    with ExitStack() as stack:
        stack.enter_context(jax.numpy_rank_promotion("raise"))
        stack.enter_context(jax.numpy_dtype_promotion("strict"))
        yield


@pytest.mark.parametrize("name", ["BipedIce-v0", "UGVRough-v1"])
def test_episodes_of_tasks_broadcast_explicitly(name: str):
    env, params = TASKS[name].make()
    key = jax.eval_shape(lambda: jax.random.key(0))
    obs, state = jax.eval_shape(env.reset, key, params)
    action = jax.ShapeDtypeStruct((len(env.action_names),), obs.dtype)
    found = jax.eval_shape(env.step, key, state, action, params)
    assert found[0].shape == obs.shape


def test_a_step_with_joint_forces_broadcasts_explicitly():
    scene = Scene.named("ice-patch", outputs="joints")

    def forces(params, state, torque):
        return step(params, scene, state, torque, 0.02, fidelity="joint")[1].joint_forces

    found = jax.eval_shape(forces, BipedParams.from_bars(), BipedState(crank_rate=3.0), 0.5)
    assert found.shape == (68,)


@pytest.mark.parametrize("kind", [BipedEnv, UGVEnv])
def test_making_parameters_and_jitted_steps_transfer_nothing_unasked(kind):
    key, env = jax.random.key(0), kind()
    action = jnp.zeros(len(env.action_names))
    with jax.transfer_guard("disallow"):
        params = env.make_params()
    params = jax.tree.map(jnp.asarray, params)
    reset = jax.jit(env.reset).lower(key, params).compile()
    with jax.transfer_guard("disallow"):
        _, state = reset(key, params)
        assert not bool(env.is_over(state))
        with pytest.raises(jax.errors.JaxRuntimeError, match="Disallowed host-to-device"):
            jax.jit(jnp.sin)(np.float32(1.0))  # the guard itself works
    assert jax.eval_shape(env.step, key, state, action, params)[0].shape


def test_what_is_numpys_by_its_interface_runs_under_the_guard():
    with jax.transfer_guard("disallow"):
        env = gymnasium.make("stickslip/Biped-v0")
        first, _ = env.reset(seed=0)
        after, *_ = env.step(np.ones(1, np.float32))
    assert np.isfinite(after).all()
    assert (first != after).any()
