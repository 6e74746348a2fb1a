"""Ten thousand steps, and a million: how far single precision drifts from double."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_START, BipedModel, BipedState, step
from tests.dynamics.biped.helpers import default_model

LONG_WALKS = {
    # what: (mu_static, mu_kinetic, crank rate at first, controller gain [N m s], held rate)
    "held at 3 rad/s, no slip": (1e6, 1e6, 3.0, 5.0, 3.0),
    "held loosely at 4 rad/s, slips each step": (0.06, 0.05, 3.0, 1.0, 4.0),
    "free crank, no slip": (1e6, 1e6, 12.0, 0.0, 0.0),
}


@jax.jit
def _long_walks(model, scenes, states, gains, wanted, size, count):
    def once(scene, state, gain, rate):
        return step(model, scene, state, gain * (rate - state.crank_rate), size)

    def body(_, now):
        states, worst, switches = now
        after, contact = jax.vmap(once)(scenes, states, gains, wanted)
        over = worst > Status.SLIP_ONSET
        after = jax.tree.map(lambda new, old: jnp.where(over, old, new), after, states)
        return after, jnp.maximum(worst, contact.status), switches + contact.switches

    none = jnp.zeros_like(states.steps)
    return jax.lax.fori_loop(0, count, body, (states, none, none))


def long_walks(
    model: BipedModel, calls: int, size: float = 0.005
) -> tuple[BipedState, np.ndarray, np.ndarray]:
    """The states after `calls` steps of LONG_WALKS, the gravest status and the switches.

    In the model's precision; its feet do not matter.
    """
    kind = jnp.asarray(model.total_mass).dtype
    mu_static, mu_kinetic, rate, gain, wanted = (
        jnp.asarray(column, kind) for column in zip(*LONG_WALKS.values(), strict=True)
    )
    zero = jnp.zeros_like(rate)
    phase = jnp.full_like(rate, SUPPORT_START)
    none = jnp.zeros(rate.shape, jnp.int32)
    states = BipedState(phase, none, rate, zero, zero, zero)
    scenes = replace(Scene.uniform(mu_static, mu_kinetic), outputs="state")
    numbers = gain, wanted, jnp.asarray(size, kind), jnp.asarray(calls)
    ended = _long_walks(model, scenes, states, *numbers)
    return jax.tree.map(np.asarray, ended)


def energy(model: BipedModel, states: BipedState) -> np.ndarray:
    """Kinetic and potential energy of feet at rest [J], by a model in double precision."""
    with jax.enable_x64(True):
        phases = jnp.asarray(np.asarray(states.phase, float))
        M = jax.vmap(lambda phase: model.inertia.at(phase).M)(phases)
        height = jax.vmap(lambda phase: model.inertia.moment_at(phase).Y)(phases)
        lifted = float(model.gravity) * np.asarray(height)
    return np.asarray(M) * np.asarray(states.crank_rate, float) ** 2 / 2 + lifted


HELD, SLIPPING, FREE = range(3)


def both(calls: int):
    """The same walks in either precision: states and gravest statuses."""
    single, words, _ = long_walks(default_model(dtype="float32"), calls)
    with jax.enable_x64(True):
        double, more, switches = long_walks(default_model(), calls)
    for word in (words, more):
        assert np.all(word <= Status.SLIP_ONSET)
    return single, double, switches


def angle(states) -> np.ndarray:
    """Of the crank, without wrapping, in double precision whatever the walk's."""
    return np.asarray(states.phase, float) + np.pi * states.steps


@pytest.mark.long
def test_ten_thousand_steps_in_single_precision():
    single, double, switches = both(10_000)
    assert np.all(double.steps > 40)
    assert switches[SLIPPING] > 300
    drift = np.abs(angle(single) - angle(double))
    assert drift[HELD] < 1e-4  # of 150 rad
    assert drift[FREE] < 0.2
    with jax.enable_x64(True):
        apart = energy(default_model(), single) - energy(default_model(), double)
    assert abs(apart[FREE]) < 2e-3  # of 38 J
    assert abs(float(single.foot_position[HELD])) == 0.0
    np.testing.assert_allclose(single.time, 10_000 * np.float64(np.float32(0.005)), rtol=6e-8)
