"""brax's conventions, with its own wrappers."""

import sys

import jax
from brax.envs.wrappers.training import wrap

from stickslip.envs import BipedEnv
from stickslip.envs.adapters import BraxEnv

env = BipedEnv(autoreset="same_step")
env = BraxEnv(env, env.default_params)
envs = wrap(env, episode_length=env.episode_length)
state = jax.jit(envs.reset)(jax.random.split(jax.random.PRNGKey(0), 2))
state = jax.jit(envs.step)(state, jax.numpy.zeros((2, env.action_size)))
if state.done.any() or not jax.numpy.isfinite(state.reward).all():
    sys.exit(f"the first step ended: {state}")
