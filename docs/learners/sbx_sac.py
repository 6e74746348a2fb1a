"""SAC of sbx (Stable-Baselines3 in JAX) on SB3VecEnv.

`pip install "stickslip[sbx]"`, then `python sbx_sac.py [STEPS]`; STEPS: of all environments.
"""

import sys

import jax.numpy as jnp
from sbx import SAC

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import SB3VecEnv, task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 200_000

env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still
model = SAC(
    "MlpPolicy",
    SB3VecEnv(env, short, num_envs=32),
    learning_rate=1e-3,
    learning_starts=2_000,
    gradient_steps=8,  # for 32 steps of an environment
    gamma=0.98,
    policy_kwargs={"net_arch": [64, 64]},
    seed=0,
)
model.learn(STEPS)

layers = [model.policy.actor_state.params["params"][f"Dense_{i}"] for i in range(3)]
weights, biases = (tuple(layer[name] for layer in layers) for name in ("kernel", "bias"))
policy = MLPPolicy(weights, biases, jnp.zeros(6), jnp.ones(6), activation="relu", squash="tanh")
found = evaluate_task(TASK, {"sac": policy}).row(TASK, "sac")
print(f"score {found.metrics['task_score'].value:.3f}")
