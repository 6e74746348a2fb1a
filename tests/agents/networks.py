"""Policies of random numbers, and of none."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents import MLPPolicy, save_policy


def make_policy(sizes=(7, 5, 4, 1), seed=2, factor=1.0, **choices) -> MLPPolicy:
    rng = np.random.default_rng(seed)
    pairs = list(itertools.pairwise(sizes))
    numbers = {
        "weights": tuple(factor * rng.normal(size=pair) for pair in pairs),
        "biases": tuple(factor * rng.normal(size=n) for _, n in pairs),
        "shift": rng.normal(size=sizes[0]),
        "scale": rng.uniform(0.5, 2.0, sizes[0]),
    }
    return MLPPolicy(**jax.device_put(jax.tree.map(np.float32, numbers)), **choices)


def still(path: str, size: int, about: dict, push: float = 0.0, **choices) -> str:
    """A policy file: the same action always."""
    weights, biases = (jnp.zeros((size, 1)),), (jnp.full(1, push),)
    policy = MLPPolicy(weights, biases, jnp.zeros(size), jnp.ones(size), **choices)
    return str(save_policy(policy, path, about))
