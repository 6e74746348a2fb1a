"""Derivatives of the event-exact walk: its end and the instants of its switches."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedState, EventExact, RK4Split, prepare, step
from stickslip.dynamics.biped.settings import Integrator
from stickslip.dynamics.pytrees import rebuilt
from tests.dynamics.biped.helpers import FINE, default_params

if TYPE_CHECKING:
    from jaxtyping import Array, Float, Int

INPUTS = ("torque", "crank rate", "mu static", "mu kinetic", "edge", "hip mass", "crank length")
"""What derivatives are taken by; the last two as factors on the default robot's values."""
OUTPUTS = ("crank angle", "crank rate", "slide", "foot velocity")
LOGGED = 4
"""Instants of switches beside them."""
NOWHERE = 10.0
"""An edge out of reach [m]."""

CASES = {
    # switches; torque, crank rate, mu static, mu kinetic, edge; phase, foot velocity, duration
    "slides off, stops": (2, (1.2, 0.0, 0.15, 0.12, NOWHERE), np.pi / 2, 0.0, 0.3),
    "breaks loose, stops": (2, (0.0, 3.0, 0.06, 0.05, NOWHERE), 2.0, 0.0, 0.7),
    "stops, slides, exchanges": (3, (0.5, -2.5, 0.2, 0.1, NOWHERE), 4.0, 0.05, 0.2),
    "onto ice": (2, (0.0, 3.0, 0.06, 0.05, 0.01), 2.0, 0.0, 0.5),
}


def walk(spec: Integrator, inputs, phase, velocity, duration):
    """One call of `step`: OUTPUTS and instants of the first LOGGED, and how many there were."""
    torque, rate, static, kinetic, edge, hip, crank = inputs
    params = default_params()
    mass = params.mass.at[12].multiply(hip)
    model = prepare(replace(params, mass=mass, crank=crank * params.crank), fidelity=FINE)
    # a crank a hair longer is not symmetric, and would end the walk at the exchange
    model = rebuilt(model, symmetric=jnp.ones((), bool))
    ice = jnp.asarray([1.0, 0.6])
    scene = Scene.patches(edge[None], static * ice, kinetic * ice, outputs="state")
    zero = jnp.zeros_like(phase)
    state = BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, velocity, zero)
    end, contact = step(model, scene, state, torque, duration, integrator=spec)
    found = [end.crank_angle, end.crank_rate, end.foot_position, end.foot_velocity]
    return jnp.stack([*found, *contact.events.times[:LOGGED]]), contact.switches


class Derivatives(NamedTuple):
    """Of one walk; columns belong to INPUTS. weighted: reverse mode, by weights @ values."""

    switches: Int[Array, ""]
    forward: Float[Array, "outputs inputs"]
    weighted: Float[Array, " inputs"]


@partial(jax.jit, static_argnums=0)
def derivatives(spec: Integrator, weights, inputs, *start) -> Derivatives:
    """Number of switches, and derivatives forward and in reverse."""
    _, push, switches = jax.linearize(lambda x: walk(spec, x, *start), inputs, has_aux=True)
    (weighted,) = jax.linear_transpose(push, inputs)(weights)
    return Derivatives(switches, jax.vmap(push, out_axes=1)(jnp.eye(len(INPUTS))), weighted)


@partial(jax.jit, static_argnums=0)
def differences(spec: Integrator, inputs, *start):
    """Central differences of fourth order by INPUTS, one column each."""
    h, shifts = 1e-5, jnp.asarray([-2.0, -1.0, 1.0, 2.0])
    shifted = inputs + h * shifts[:, None, None] * jnp.eye(len(INPUTS))
    values = jax.vmap(jax.vmap(lambda x: walk(spec, x, *start)[0]))(shifted)
    far_below, below, above, far_above = values
    return ((8 * (above - below) - (far_above - far_below)) / (12 * h)).T


def worst(got: np.ndarray, want: np.ndarray) -> np.ndarray:
    """Largest error of each output's derivatives, relative to the output's largest derivative."""
    scale = np.max(np.abs(want), axis=1)
    return np.max(np.abs(got - want), axis=1) / np.where(scale > 0, scale, 1.0)


pytestmark = pytest.mark.long

SPEC = EventExact(record_events=True)


@cache
def given(case: str) -> tuple[jax.Array, ...]:
    _, inputs, *start = CASES[case]
    return jnp.asarray([*inputs, 1.0, 1.0]), *map(jnp.asarray, start)


@cache
def weights() -> np.ndarray:
    return np.random.default_rng(3).normal(size=len(OUTPUTS) + LOGGED)


@cache
def of(case: str) -> Derivatives:
    return jax.tree.map(np.asarray, derivatives(SPEC, jnp.asarray(weights()), *given(case)))


@pytest.mark.parametrize("case", CASES)
def test_end_and_instants_have_the_derivatives_that_differences_show(float64, case):
    switches = CASES[case][0]
    assert of(case).switches == switches
    want = np.asarray(differences(SPEC, *given(case)))
    assert np.any(want[len(OUTPUTS) + switches - 1])  # the last switch's instant moves
    # measured: 6e-9 at the default tolerance of 1e-9
    assert worst(of(case).forward, want).max() < 1e-7


@pytest.mark.parametrize("case", CASES)
def test_reverse_derivatives_are_the_forward_ones(float64, case):
    want = weights() @ of(case).forward
    assert np.abs(of(case).weighted - want).max() < 1e-12 * np.abs(want).max()


def test_split_steps_of_fixed_length_have_the_same_derivatives_to_their_order(float64):
    """Of the walk's end and of its instants; measured: 2e-5 with 40 steps, 1e-7 with 160."""
    case = "stops, slides, exchanges"
    spec = RK4Split(substeps=40, max_events=8, record_events=True)
    found = derivatives(spec, jnp.asarray(weights()), *given(case))
    assert worst(np.asarray(found.forward), of(case).forward).max() < 1e-4
    want = weights() @ np.asarray(found.forward)
    assert np.abs(np.asarray(found.weighted) - want).max() < 1e-12 * np.abs(want).max()
