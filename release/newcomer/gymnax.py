"""gymnax's conventions."""

import sys

import jax

from stickslip.envs import BipedEnv
from stickslip.envs.adapters import GymnaxEnv

env, key = BipedEnv(autoreset="same_step"), jax.random.key(0)
env = GymnaxEnv(env, env.default_params, values=5)
obs, state = env.reset(key)
obs, state, reward, done, info = env.step(key, state, jax.numpy.zeros(1))
if done or not env.observation_space().contains(obs):
    sys.exit(f"the first step ended: {obs}, {info}")
