"""Looking ahead with the process's own step."""

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.agents.optimum.policy import Ahead, look_ahead
from stickslip.agents.optimum.value_iteration import finite_horizon, transitions
from tests.agents.optimum.processes import Balance

OUTSIDE = -9.0


def solved(cells: int):
    process = Balance.of(cells)
    return process, finite_horizon(transitions(process, OUTSIDE), 60)


def by_hand(process, values, x: float, depth: int) -> tuple[float, set[float]]:
    """The best of all sequences of actions, one by one, and with which actions such begin."""
    nodes = np.asarray(process.grid.sheets[0].axes[0].nodes)
    found = {}
    for sequence in product(np.asarray(process.actions)[:, 0], repeat=depth):
        at, earned = x, 0.0
        for action in sequence:
            at = 1.5 * at + action / 4
            if abs(at) > 1:
                earned -= 9
                break
            earned += 1 + at
        else:
            earned += np.interp(at, nodes, values)
        found[sequence[0]] = max(earned, found.get(sequence[0], -np.inf))
    best = max(found.values())
    return best, {first for first, worth in found.items() if worth > best - 1e-4}


@pytest.mark.parametrize("depth", [1, 4])
def test_a_beam_that_keeps_every_way_finds_the_best_of_all(depth):
    process, values = solved(6)
    look = jax.jit(lambda x: look_ahead(process, values, x, OUTSIDE, Ahead(depth, 5**3)))
    for x in np.random.default_rng(1).uniform(-0.7, 0.7, 20):
        action, value = look(jnp.asarray(x, jnp.float32))
        best, first = by_hand(process, values, float(np.float32(x)), depth)
        assert float(value) == pytest.approx(best, abs=1e-4)
        assert min(abs(float(action[0]) - one) for one in first) < 1e-6


def balanced(process, values, ahead: Ahead, starts) -> np.ndarray:
    """Steps until the pole falls, at most 60."""

    def one(x):
        def body(carry, _):
            x, up = carry
            action, _ = look_ahead(process, values, x, OUTSIDE, ahead)
            after, _, fell = process.step(x, action)
            return (jnp.where(up, after, x), up & ~fell), up & ~fell

        return jnp.sum(jax.lax.scan(body, (x, jnp.asarray(True)), None, length=60)[1])

    return np.asarray(jax.jit(jax.vmap(one))(jnp.asarray(starts, jnp.float32)))


def test_looking_ahead_finds_the_way_that_the_cells_hide():
    process, values = solved(8)  # cells of 1/4; no way back from 0.5 on
    starts = np.linspace(-0.49, 0.49, 50)
    assert np.any(balanced(process, values, Ahead(1, 8), starts) < 60)
    assert np.all(balanced(process, values, Ahead(6, 8), starts) == 60)
