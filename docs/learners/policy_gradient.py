"""Analytic policy gradients on the UGV: optax follows slopes of returns through the simulator.

`pip install "stickslip[train]"`, then `python policy_gradient.py [STEPS] [TASK] [FILE]`.

The UGV's step is differentiable, and an episode's return is a sum over places: its slope in the
network's weights, by back-propagation through the whole episode, is exact and tame. A failure has
no slope, so what a place lacks of margins costs something before it fails.
"""

import sys
from dataclasses import replace
from functools import partial
from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import optax

from stickslip.agents import MLPPolicy, evaluate_task, save_policy
from stickslip.envs import FrameStack, known_of, task_by_name

HISTORY, HIDDEN, EPISODES, RATE, CLIP = 12, 128, 64, 1e-3, 10.0
GAINS = 1.4, 1.4, 0.01
MOST = 20_000  # updates of a learner that is not told how many there will be
sound = jax.custom_vjp(lambda x: x)
sound.defvjp(lambda x: (x, None), lambda _, slope: (jnp.nan_to_num(slope, 0.0, 0.0, 0.0),))


def lacking(at, params):
    """What a station lacks of margins, in parts of them, squared."""
    weight, pressed = params.vehicle.weight, jnp.minimum(at.N_rear, at.N_front)
    margins = (
        (at.clearance - params.min_clearance, 0.1),
        (at.wheel_clearance, 0.1),
        (pressed, 0.1 * weight),
        (at.grip, 0.05 * weight),
    )
    return sum(jnp.maximum(1 - left / size, 0) ** 2 for left, size in margins)


def network(layers, shift, scale):
    """The policy of these layers, without its history."""
    return MLPPolicy(*map(tuple, zip(*layers, strict=True)), shift, scale, observation_clip=CLIP)


class PolicyGradient:
    """A learner on a task. updates: after so many its steps have shrunk to 0; None: never."""

    def __init__(self, task, updates=None, seed=0):
        self.env, self.params = task.make("disabled")
        self.env = FrameStack(self.env, HISTORY, "disabled")
        self.length, scale = task.max_episode_steps, known_of(task).scale
        self.unit = scale.one - scale.zero
        self.updates = updates or MOST
        rate = RATE if updates is None else optax.cosine_decay_schedule(RATE, updates)
        self.adam = optax.chain(
            optax.scale(1 / EPISODES), optax.clip_by_global_norm(1.0), optax.adam(rate)
        )
        self.begin(seed)

    def begin(self, seed):
        """Begin anew, with the weights and episodes of a seed."""
        bounds, acts = self.env.observation_bounds(self.params), len(self.env.action_names)
        sizes = len(bounds[0]), HIDDEN, HIDDEN, acts
        keys = jax.random.split(jax.random.key(seed), len(GAINS) + self.updates)
        first, self.keys, self.layers = keys[: len(GAINS)], iter(keys[len(GAINS) :]), []
        for key, (inputs, outputs), gain in zip(first, pairwise(sizes), GAINS, strict=True):
            matrix = jax.random.orthogonal(key, max(inputs, outputs))[:inputs, :outputs]
            self.layers.append((gain * matrix, jnp.zeros(outputs)))
        self.memory, self.steps = self.adam.init(self.layers), 0
        self.seen = jnp.zeros(sizes[0]), jnp.ones(sizes[0])
        obs = np.asarray(self.update(self.layers, self.memory, self.seen, keys[-1])[2])  # idle legs
        obs = obs.reshape(-1, sizes[0])
        self.seen = jnp.asarray(obs.mean(0)), jnp.asarray(np.maximum(obs.std(0), 0.3))

    def cost(self, policy, key):
        """Minus an episode's return, in score, and what it lacks; its observations."""

        def step(now, _):
            obs, state, goes_on = jax.tree.map(
                lambda x: sound(x) if x.dtype.kind == "f" else x, now
            )
            wanted = sound(policy.unlimited(obs))
            given = state, jnp.clip(wanted, -1, 1), self.params
            after, state, reward, failed = self.env.step_env(*given)[:4]
            beyond = 0.1 * jnp.sum(jnp.maximum(jnp.abs(wanted) - 1, 0) ** 2)
            short = lacking(state.state.station, self.params)
            missed = 3 * jnp.minimum(jnp.where(failed, 0, short), 10)
            paid = jnp.where(failed, 1.5, (beyond + missed) / self.length - reward / self.unit)
            return (after, state, goes_on & ~failed), (jnp.where(goes_on, paid, 0), obs)

        begun = (*self.env.reset_env(key, self.params), jnp.asarray(True))
        paid, obs = jax.lax.scan(jax.checkpoint(step), begun, length=self.length)[1]
        return paid.sum(), obs

    @partial(jax.jit, static_argnums=0)
    def update(self, layers, memory, seen, key):
        """Layers and Adam's memory after a step, and observations; each slope shortened to 10."""
        loss = lambda layers, key: self.cost(network(layers, *seen), key)  # noqa: E731
        slope = jax.grad(loss, has_aux=True)
        slopes, obs = jax.vmap(slope, (None, 0))(layers, jax.random.split(key, EPISODES))
        share = jnp.minimum(1, 10 / jnp.maximum(jax.vmap(optax.global_norm)(slopes), 1e-9))
        total = jax.tree.map(lambda x: jnp.tensordot(share, x, 1), slopes)
        change, memory = self.adam.update(total, memory)
        return optax.apply_updates(layers, change), memory, obs

    def advance(self):
        """One update, of EPISODES episodes."""
        given = self.layers, self.memory, self.seen, next(self.keys)
        self.layers, self.memory, _ = self.update(*given)
        self.steps += EPISODES * self.length

    def policy(self):
        """The policy that was learnt so far."""
        return replace(network(self.layers, *self.seen), history=HISTORY).validate()


def main(steps="24_000_000", name="UGVPatchyGrip-v1", file=None):
    """Keep the best on validation episodes, and print its score."""
    task = task_by_name(name)
    updates = max(1, int(steps) // (EPISODES * task.max_episode_steps))
    learner, best = PolicyGradient(task, updates), (-np.inf, None)
    for number in range(1, updates + 1):
        learner.advance()
        if number % 100 == 0 or number == updates:
            policy = learner.policy()
            found = evaluate_task(name, {"it": policy}, seeds=range(2**31, 2**31 + 64))
            earned = found.row(name, "it").metrics["return"].value
            print(f"{number} updates: return {earned:.4g} on validation episodes", flush=True)
            best = max(best, (earned, policy), key=lambda one: one[0])
    if file:
        save_policy(best[1], file)
    found = evaluate_task(name, {"it": best[1]}).row(name, "it")
    print(f"score {found.metrics['task_score'].value:.3f}")


if __name__ == "__main__":
    main(*sys.argv[1:])
