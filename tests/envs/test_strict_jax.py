"""What large code bases of JAX set: no promotion of ranks or types."""

from contextlib import ExitStack

import jax
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, BipedState, step
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
    assert jax.eval_shape(env.step, key, state, action, params)[0].shape == obs.shape


def test_a_step_with_joint_forces_broadcasts_explicitly():
    scene = Scene.named("ice-patch", outputs="joints")

    def forces(params, state, torque):
        return step(params, scene, state, torque, 0.02, fidelity="joint")[1].joint_forces

    found = jax.eval_shape(forces, BipedParams.from_bars(), BipedState(crank_rate=3.0), 0.5)
    assert found.shape == (68,)
