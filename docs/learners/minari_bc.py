"""Minari: record episodes with its collector, read them with its loader, and clone the better half.

`pip install "stickslip[train]" "minari[hdf5]"`, then `python minari_bc.py [EPISODES]`. 200 episodes
are 12,855 steps and 4.8 MB.
"""

import os
import sys
import tempfile
from itertools import pairwise

import gymnasium
import jax
import jax.numpy as jnp
import minari
import numpy as np
import optax

import stickslip  # noqa: F401  (registers the environments)
from stickslip.agents import MLPPolicy, evaluate_task, load_policy

TASK, NAME = "UGVLowGrip-v1", "stickslip/low-grip-v0"
EPISODES = int(sys.argv[1]) if sys.argv[1:] else 200
os.environ.setdefault("MINARI_DATASETS_PATH", tempfile.mkdtemp())
env = minari.DataCollector(gymnasium.make(f"stickslip/{TASK}"))
env.action_space.seed(0)
act, shipped = jax.jit(MLPPolicy.__call__), load_policy("ugv-low-grip")
for episode in range(EPISODES):  # under the shipped policy and a random one in turn
    (obs, _), over = env.reset(seed=2**20 + episode), False  # test episodes are 0, 1, ...
    while not over:
        action = env.action_space.sample() if episode % 2 else np.asarray(act(shipped, obs))
        obs, _, terminated, truncated, _ = env.step(action)
        over = terminated or truncated
env.create_dataset(NAME, description="the shipped policy and a random one in turn")

data = minari.load_dataset(NAME)
print(f"{data.total_episodes} episodes, {data.total_steps} steps, {data.storage.get_size():.1f} MB")
better = sorted(data.iterate_episodes(), key=lambda one: one.rewards.sum())[EPISODES // 2 :]
seen = np.concatenate([one.observations[:-1] for one in better])
actions = np.concatenate([one.actions for one in better])
sizes, init = (seen.shape[1], 64, 64, actions.shape[1]), jax.nn.initializers.lecun_normal()
weights = tuple(map(init, jax.random.split(jax.random.key(0), 3), pairwise(sizes)))
clone = MLPPolicy(weights, tuple(map(jnp.zeros, sizes[1:])), seen.mean(0), seen.std(0) + 1e-6)
optimiser = optax.adam(1e-3)


@jax.jit
def fitted(clone, moments):
    """A step of Adam on all of the data."""
    slope = jax.grad(lambda clone: jnp.mean((clone.unlimited(seen) - actions) ** 2))(clone)
    change, moments = optimiser.update(slope, moments)
    return optax.apply_updates(clone, change), moments


moments = optimiser.init(clone)
for _ in range(1000):
    clone, moments = fitted(clone, moments)
found = evaluate_task(TASK, {"clone": clone}).row(TASK, "clone")
print(f"score {found.metrics['task_score'].value:.3f}")
