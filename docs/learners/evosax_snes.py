"""SNES of evosax over a linear policy; `stickslip.envs.collect` tries the candidates.

`pip install stickslip evosax`, then `python evosax_snes.py [STEPS]`; STEPS: of all environments.
"""

import sys

import jax
import jax.numpy as jnp
from evosax.algorithms import SNES

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import collect, task_by_name

TASK = "BipedSteady-v0"
STEPS = int(sys.argv[1]) if sys.argv[1:] else 10_000_000
env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still


@jax.jit
def cost(weights, key):
    """Minus the mean return of 32 episodes."""
    act = lambda weights, obs, key: jnp.tanh(obs @ weights)  # noqa: E731
    found = collect(env, short, act, key, num_envs=32, steps=75, policy_params=weights)
    return -found.reward.sum() / 32


search = SNES(64, jnp.zeros((6, 1)))
chosen = search.default_params.replace(std_init=0.3)
state = search.init(jax.random.key(0), jnp.zeros((6, 1)), chosen)
for key in jax.random.split(jax.random.key(1), max(1, STEPS // (64 * 32 * 75))):
    tried, state = search.ask(key, state, chosen)
    state, _ = search.tell(key, tried, jax.vmap(cost, (0, None))(tried, key), state, chosen)

mean, zero = search.get_mean(state), jnp.zeros(1)
policy = MLPPolicy((mean,), (zero,), jnp.zeros(6), jnp.ones(6), squash="tanh")
found = evaluate_task(TASK, {"snes": policy}).row(TASK, "snes")
print(f"score {found.metrics['task_score'].value:.3f}")
