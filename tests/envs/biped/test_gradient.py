"""Derivatives of a return by actions and parameters, against finite differences."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from tests.envs.helpers import task

pytestmark = pytest.mark.long

ACTIONS = (0.2, 0.15, 0.25, -0.1, 0.05, 0.1)


@jax.jit
@jax.value_and_grad
def return_of(x: dict[str, Any]) -> jax.Array:
    """Return of the first control steps, from a walk that has begun."""
    env, params = task(dtype="float64")
    robot = params.robot
    bare = robot.bare
    bare = replace(bare, mass=x["mass"] * bare.mass, inertia=x["mass"] * bare.inertia)
    heavier = replace(robot, bare=bare)
    params = replace(
        params,
        robot=heavier,
        scene=Scene.uniform(x["mu_static"], x["mu_kinetic"]),
        **{name: x[name] for name in ("torque_limit", "mean_rate", "copper_loss")},
    )
    key = jax.random.key(0)
    _, state = env.reset(key, params)
    biped = replace(state.biped, phase=x["phase"], crank_rate=x["crank_rate"])
    state = replace(state, biped=biped)

    def body(state, action):
        _, state, reward, *_ = env.step(key, state, action[None], params)
        return state, reward

    return jnp.sum(jax.lax.scan(body, state, x["actions"])[1])


def point(mu: float) -> dict[str, Any]:
    numbers = {"mu_static": mu, "mu_kinetic": 0.8 * mu, "phase": 2.2, "crank_rate": 2.0}
    numbers |= {"mass": 1.1, "torque_limit": 4.0, "mean_rate": 3.0, "copper_loss": 0.5}
    given = {name: jnp.asarray(value) for name, value in numbers.items()}
    return given | {"actions": jnp.asarray(ACTIONS)}


@pytest.mark.parametrize("mu", [0.9, 0.02])
def test_the_gradient_of_a_return_is_that_of_finite_differences(float64, mu):
    x = point(mu)
    value, gradient = return_of(x)
    assert np.isfinite(value)
    flat, structure = jax.tree.flatten(x)
    slopes = jax.tree.leaves(gradient)
    for i, (leaf, slope) in enumerate(zip(flat, slopes, strict=True)):
        assert np.all(np.isfinite(slope))
        for index in np.ndindex(leaf.shape):
            values = []
            for h in (1e-5, -1e-5):
                moved = [*flat[:i], leaf.at[index].add(h), *flat[i + 1 :]]
                values.append(return_of(jax.tree.unflatten(structure, moved))[0])
            expected = float(values[0] - values[1]) / 2e-5
            assert slope[index] == pytest.approx(expected, rel=1e-5, abs=1e-8), (i, index)


def test_friction_matters_only_where_the_foot_slides(float64):
    grip, ice = return_of(point(0.9))[1], return_of(point(0.02))[1]
    assert grip["mu_static"] == grip["mu_kinetic"] == 0
    assert ice["mu_kinetic"] != 0
    for gradient in (grip, ice):
        assert np.all(np.asarray(gradient["actions"]) != 0)


def test_the_gradient_stays_finite_through_falls(float64):
    value, gradient = return_of(point(0.9) | {"torque_limit": jnp.asarray(100.0)})
    assert value < -5  # a fall
    assert all(np.all(np.isfinite(slope)) for slope in jax.tree.leaves(gradient))
