"""Analytic policy gradients on the UGV: optax follows slopes of returns through the simulator.

`pip install "stickslip[train]"`, then `python policy_gradient.py [STEPS] [TASK] [FILE]`.

The UGV's step is differentiable, and an episode's return is a sum over places: its slope in the
network's weights, by back-propagation through the whole episode, is exact and tame. A failure has
no slope, so what a place lacks of MARGINS costs something before it fails.
"""

import sys
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import optax

from stickslip.agents import MLPPolicy, evaluate_task, save_policy
from stickslip.envs import FrameStack, known_of, task_by_name

STEPS = int(sys.argv[1]) if sys.argv[1:] else 24_000_000
TASK = task_by_name(sys.argv[2] if sys.argv[2:] else "UGVPatchyGrip-v1")
HISTORY, HIDDEN, EPISODES, RATE, CLIP = 12, 128, 64, 1e-3, 10.0
env, params = TASK.make("disabled")
env = FrameStack(env, HISTORY, "disabled")
length, weight = TASK.max_episode_steps, params.vehicle.weight
MARGINS = {"clearance": 0.1, "wheel_clearance": 0.1, "normal": 0.1 * weight, "grip": 0.05 * weight}
scale = known_of(TASK).scale
unit = scale.one - scale.zero
sound = jax.custom_vjp(lambda x: x)
sound.defvjp(lambda x: (x, None), lambda _, slope: (jnp.nan_to_num(slope, 0.0, 0.0, 0.0),))


def lacking(at):
    """What a station lacks of MARGINS, in parts of them, squared."""
    left = {"clearance": at.clearance - params.min_clearance, "wheel_clearance": at.wheel_clearance}
    left |= {"normal": jnp.minimum(at.N_rear, at.N_front), "grip": at.grip}
    return sum(jnp.maximum(1 - left[name] / size, 0) ** 2 for name, size in MARGINS.items())


def cost(policy, key):
    """Minus an episode's return, in score, and what it lacks; its observations."""

    def step(now, _):
        obs, state, goes_on = jax.tree.map(lambda x: sound(x) if x.dtype.kind == "f" else x, now)
        wanted = sound(policy.unlimited(obs))
        given = state, jnp.clip(wanted, -1, 1), params
        after, state, reward, failed = env.step_env(*given)[:4]
        beyond = 0.1 * jnp.sum(jnp.maximum(jnp.abs(wanted) - 1, 0) ** 2)
        missed = 3 * jnp.minimum(jnp.where(failed, 0, lacking(state.state.station)), 10)
        paid = jnp.where(failed, 1.5, (beyond + missed) / length - reward / unit)
        return (after, state, goes_on & ~failed), (jnp.where(goes_on, paid, 0), obs)

    begun = (*env.reset_env(key, params), jnp.asarray(True))
    paid, obs = jax.lax.scan(jax.checkpoint(step), begun, length=length)[1]
    return paid.sum(), obs


def network(layers, shift, scale):
    """The policy of these layers, without its history."""
    return MLPPolicy(*map(tuple, zip(*layers, strict=True)), shift, scale, observation_clip=CLIP)


@jax.jit
def update(layers, memory, seen, key):
    """Layers and Adam's memory after a step, and the observations; each slope shortened to 10."""
    slope = jax.grad(lambda *given: cost(network(given[0], *seen), given[1]), has_aux=True)
    slopes, obs = jax.vmap(slope, (None, 0))(layers, jax.random.split(key, EPISODES))
    share = jnp.minimum(1, 10 / jnp.maximum(jax.vmap(optax.global_norm)(slopes), 1e-9))
    change, memory = adam.update(jax.tree.map(lambda x: jnp.tensordot(share, x, 1), slopes), memory)
    return optax.apply_updates(layers, change), memory, obs


updates = max(1, STEPS // (EPISODES * length))
adam = optax.chain(
    optax.scale(1 / EPISODES),
    optax.clip_by_global_norm(1.0),
    optax.adam(optax.cosine_decay_schedule(RATE, updates)),
)
sizes = len(env.observation_bounds(params)[0]), HIDDEN, HIDDEN, len(env.action_names)
keys = jax.random.split(jax.random.key(0), len(sizes) - 1 + updates)
layers = []
for key, inputs, outputs, gain in zip(keys[:3], sizes, sizes[1:], (1.4, 1.4, 0.01), strict=False):
    matrix = jax.random.orthogonal(key, max(inputs, outputs))[:inputs, :outputs]
    layers.append((gain * matrix, jnp.zeros(outputs)))
memory, seen = adam.init(layers), (jnp.zeros(sizes[0]), jnp.ones(sizes[0]))
obs = np.asarray(update(layers, memory, seen, keys[-1])[2]).reshape(-1, sizes[0])  # of idle legs
seen, best = (jnp.asarray(obs.mean(0)), jnp.maximum(obs.std(0), 0.3)), (-np.inf, None)
for number, key in enumerate(keys[len(sizes) - 1 :], 1):
    layers, memory, _ = update(layers, memory, seen, key)
    if number % 100 == 0 or number == updates:  # the best on validation episodes is kept
        policy = replace(network(layers, *seen), history=HISTORY).validate()
        found = evaluate_task(TASK.name, {"it": policy}, seeds=range(2**31, 2**31 + 64))
        earned = found.row(TASK.name, "it").metrics["return"].value
        print(f"{number} updates: return {earned:.4g} on validation episodes", flush=True)
        best = max(best, (earned, policy), key=lambda one: one[0])

if sys.argv[3:]:
    save_policy(best[1], sys.argv[3])
found = evaluate_task(TASK.name, {"it": best[1]}).row(TASK.name, "it")
print(f"score {found.metrics['task_score'].value:.3f}")
