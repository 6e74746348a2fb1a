"""PPO in purejaxrl's style on GymnaxEnv: pure functions, one compiled update, optax.

`pip install "stickslip[train]"`, then `python purejaxrl.py [STEPS]`; STEPS: of all environments.
"""

import sys
from itertools import pairwise

import jax
import jax.numpy as jnp
import optax

from stickslip.agents import MLPPolicy, evaluate_task
from stickslip.envs import GymnaxEnv, task_by_name

TASK, N, T = "BipedSteady-v0", 256, 32
STEPS = int(sys.argv[1]) if sys.argv[1:] else 2_000_000
env, params = task_by_name(TASK).make("same_step")
short = params.replace(time_limit=1.5, fall_penalty=1.0)  # else it learns to stand still
env = GymnaxEnv(env, short, values=5)
optimiser = optax.chain(optax.clip_by_global_norm(0.5), optax.adam(1e-3))


def layers(key):
    """Weights and biases, of the policy as of the critic."""
    sizes, init = (6, 64, 64, 1), jax.nn.initializers.lecun_uniform()
    keys = jax.random.split(key, 3)
    return tuple(map(init, keys, pairwise(sizes))), tuple(map(jnp.zeros, sizes[1:]))


def network(layers):
    """The network with these."""
    return MLPPolicy(*layers, jnp.zeros(6), jnp.ones(6))


def chance(nets, seen, actions):
    """Log of the actions' probability density, up to a constant."""
    return -(((actions - network(nets[0]).unlimited(seen)) / jnp.exp(nets[2])) ** 2) / 2 - nets[2]


@jax.jit
def update(learner, obs, state, key):
    """T steps of N environments, then 64 steps of Adam on 512 of their rows each."""
    nets = learner[0]
    critic = network(nets[1]).unlimited

    def act(carry, key):
        obs, state = carry
        keys = jax.random.split(key, N + 1)
        noise = jnp.exp(nets[2]) * jax.random.normal(keys[0], (N, 1))
        action = network(nets[0]).unlimited(obs) + noise
        after, state, reward, done, info = jax.vmap(env.step)(keys[1:], state, action)
        ahead = info["discount"][:, None] * critic(info["final_observation"])
        error = reward[:, None] + 0.98 * ahead - critic(obs)
        return (after, state), (obs, action, error, 0.98 * 0.95 * (1 - done[:, None]))

    (obs, state), rows = jax.lax.scan(act, (obs, state), jax.random.split(key, T))
    summed = lambda later, row: 2 * (row[0] + row[1] * later,)  # noqa: E731
    gains = jax.lax.scan(summed, jnp.zeros((N, 1)), rows[2:], reverse=True)[1]
    before, targets = chance(nets, *rows[:2]), critic(rows[0]) + gains
    rows = *rows[:2], before, targets, (gains - gains.mean()) / gains.std()

    def loss(nets, seen, actions, before, targets, gains):
        ratio = jnp.exp(chance(nets, seen, actions) - before)
        won = jnp.minimum(ratio * gains, jnp.clip(ratio, 0.8, 1.2) * gains)
        return jnp.mean((network(nets[1]).unlimited(seen) - targets) ** 2 - won)

    def fit(learner, which):
        batch = (one.reshape(N * T, -1)[which] for one in rows)
        change, moments = optimiser.update(jax.grad(loss)(learner[0], *batch), learner[1])
        return (optax.apply_updates(learner[0], change), moments), None

    chosen = jax.random.randint(key, (64, 512), 0, N * T)
    return jax.lax.scan(fit, learner, chosen)[0], obs, state


first, *starts = jax.random.split(jax.random.key(0), N + 1)
nets = layers(first), layers(starts[0]), jnp.array(-1.0)  # last: log of the noise
learner, *now = (nets, optimiser.init(nets)), *jax.vmap(env.reset)(jnp.stack(starts))
for key in jax.random.split(jax.random.key(1), max(1, STEPS // (N * T))):
    learner, *now = update(learner, *now, key)

found = evaluate_task(TASK, {"ppo": network(learner[0][0])}).row(TASK, "ppo")
print(f"score {found.metrics['task_score'].value:.3f}")
