"""Cross-entropy method on the population rollouts of gymnax 1.0, in its six-value protocol.

`pip install "stickslip[gymnax]" "gymnax>=1"`, which takes Gymnasium back to 1.3; then
`python gymnax1.py [STEPS]`; STEPS: of all environments.
"""

import sys

import jax
import jax.numpy as jnp
from gymnax.experimental import RolloutWrapper

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import GymnaxEnv, task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 3_000_000

env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # 75 steps; else it learns to stand still
rollouts = RolloutWrapper(
    lambda weights, obs, key: jnp.tanh(obs @ weights),
    env=GymnaxEnv(env, short),
    env_params=short,
    num_env_steps=75,
)

mean, deviation = jnp.zeros((6, 1)), 0.5
for key in jax.random.split(jax.random.key(0), max(1, STEPS // (64 * 32 * 75))):
    noise_key, *episodes = jax.random.split(key, 33)
    tried = mean + deviation * jax.random.normal(noise_key, (64, 6, 1))
    returns = rollouts.population_rollout(jnp.stack(episodes), tried)[-1].mean((1, 2))
    best = tried[jnp.argsort(returns)[-16:]]
    mean, deviation = best.mean(0), best.std(0) + 0.02

policy = MLPPolicy((mean,), (jnp.zeros(1),), jnp.zeros(6), jnp.ones(6), squash="tanh")
found = evaluate_task(TASK, {"cem": policy}).row(TASK, "cem")
print(f"score {found.metrics['task_score'].value:.3f}")
