"""What each step cost against the optimum, in a Minari data set, and a clone that makes use of it.

`pip install "stickslip[train,data]"`, then `python -m docs.learners.regret [EPISODES]` in a
checkout. `infos["value"]` is the return to come of the best drive over the episode's ground,
`infos["regret"]` what the step that led to a row lost of it (see RegretInfo).
"""

import os
import sys
import tempfile
from itertools import pairwise

import jax
import jax.numpy as jnp
import minari
import numpy as np
import optax

from stickslip.agents import MLPPolicy, evaluate_task, load_policy, record

TASK, POLICY, NAME = "UGVRandomBumps-v1", "ugv-random-bumps", "stickslip/random-bumps-v0"
NOISE = {"expert": 0.0, "medium": 0.5, "random": 1.0}
SCALE = 0.03  # J, the best on validation episodes of 0.003, 0.01, 0.03, 0.1 and 0.3
EPISODES = int(sys.argv[1]) if sys.argv[1:] else 30


os.environ.setdefault("MINARI_DATASETS_PATH", tempfile.mkdtemp())
how = {"noise": list(NOISE.values()), "episodes": EPISODES, "regret": True}
print(record(TASK, {POLICY: load_policy(POLICY)}, NAME, **how).rounded(4).terminal())
data = minari.load_dataset(NAME)
names = [name for name in NOISE for _ in range(EPISODES)]
print(f"{data.total_episodes} episodes, {data.total_steps} steps, {data.storage.get_size():.1f} MB")
episodes = list(data.iterate_episodes())
for name in NOISE:
    of = [one for one in episodes if names[one.id] == name]
    earned, lost = (
        np.mean([np.sum(part) for part in each])
        for each in zip(*((one.rewards, one.infos["regret"]) for one in of), strict=True)
    )
    print(f"{name}: return {earned:.4g}, regret {lost:.4g}")
seen = np.concatenate([one.observations[:-1] for one in episodes])
actions = np.concatenate([one.actions for one in episodes])
regret = np.concatenate([one.infos["regret"][1:] for one in episodes])
optimiser = optax.adam(optax.cosine_decay_schedule(2e-3, 3000))


@jax.jit
def fitted(clone, moments, weight):
    """A step of Adam on all of the data."""
    error = lambda clone: jnp.mean(weight * jnp.mean((clone.unlimited(seen) - actions) ** 2, 1))  # noqa: E731
    change, moments = optimiser.update(jax.grad(error)(clone), moments)
    return optax.apply_updates(clone, change), moments


sizes, init = (seen.shape[1], 64, 64, actions.shape[1]), jax.nn.initializers.lecun_normal()
for name, weight in {
    "all alike": np.ones_like(regret),
    "by regret": np.exp(-np.maximum(regret, 0) / SCALE),
}.items():
    clones = {}
    for seed in range(5):
        weights = tuple(map(init, jax.random.split(jax.random.key(seed), 3), pairwise(sizes)))
        clone = MLPPolicy(
            weights, tuple(map(jnp.zeros, sizes[1:])), seen.mean(0), seen.std(0) + 1e-6
        )
        moments = optimiser.init(clone)
        for _ in range(3000):
            clone, moments = fitted(clone, moments, weight / weight.mean())
        clones[f"{seed}"] = clone
    rows = [row.metrics for row in evaluate_task(TASK, clones).rows]
    failed, score = (np.array([one[of].value for one in rows]) for of in ("failures", "task_score"))
    print(f"steps {name}: fail in {failed.mean():.1%} ({failed}), scores {np.round(score, 2)}")
