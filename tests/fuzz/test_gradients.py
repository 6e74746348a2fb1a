"""Gradients through random walks with slip are numbers, and across patch edges the right ones."""

from __future__ import annotations

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status, Uniform
from stickslip.dynamics.biped import (
    BipedParams,
    BipedState,
    EventExact,
    RK4Split,
    prepare,
    simulate,
    step,
)

pytestmark = pytest.mark.long

WALKS = 250
STEPS = 10
INTEGRATORS = {"rk4_split": RK4Split(2), "event_exact": EventExact(1e-7, 1e-9, max_steps=60)}


def walks(seed: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    static = random.uniform(0.02, 0.12, WALKS)
    return {
        "mu_static": static,
        "mu_kinetic": static * random.uniform(0.4, 1.0, WALKS),
        "phase": random.uniform(1.6, 4.7, WALKS),
        "crank_rate": random.uniform(1.0, 5.0, WALKS),
        "foot_velocity": random.normal(0, 0.05, WALKS) * (random.uniform(size=WALKS) < 0.4),
        "torque": random.uniform(-0.5, 1.5, WALKS),
    }


@pytest.mark.parametrize("name", INTEGRATORS)
def test_gradients_of_random_walks_with_slip_are_numbers(float64, name):
    model = prepare(BipedParams.from_bars(), fidelity="table")

    def walk(given):
        scene = Scene(Uniform(given["mu_static"], given["mu_kinetic"]))
        state = BipedState(
            phase=given["phase"],
            crank_rate=given["crank_rate"],
            foot_velocity=given["foot_velocity"],
        )
        spec = INTEGRATORS[name]
        path = simulate(model, scene, state, given["torque"], 0.3, 0.03, integrator=spec)
        one = partial(step, model, scene, path.final, given["torque"], 0.02)
        last, contact = one(integrator=spec)
        value = last.crank_angle + last.foot_position + last.crank_rate + last.foot_velocity
        slid = jnp.sum(path.contacts.slide_distance) + contact.slide_distance
        told = jnp.maximum(path.status, contact.status), jnp.sum(path.contacts.switches), slid
        return value + slid, told

    gradients, (status, switches, slid) = jax.jit(jax.vmap(jax.grad(walk, has_aux=True)))(walks(2))
    for field, slopes in gradients.items():
        assert np.all(np.isfinite(slopes)), field
    assert np.sum(np.asarray(slid) > 0) > WALKS / 2
    went_on = np.asarray(status) <= Status.SLIP_ONSET
    print(
        f"\ngradients {name}: {WALKS} walks, {int(np.sum(switches))} events, "
        f"{int(np.sum(slid > 0))} with slip, {int(np.sum(went_on))} to the end; none non-finite"
    )
