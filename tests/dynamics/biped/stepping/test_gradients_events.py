"""Derivatives of the event-exact walk: its end and the instants of its switches.

The reference is a central difference of fourth order of the walk itself.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    BipedModel,
    BipedParams,
    BipedState,
    EventExact,
    RK4Split,
    Table,
    prepare,
    step,
)
from stickslip.dynamics.biped.settings import Integrator

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
    # torque, crank rate, mu static, mu kinetic, edge; phase, foot velocity, duration
    "slides off, stops": ((1.2, 0.0, 0.15, 0.12, NOWHERE), np.pi / 2, 0.0, 0.3),
    "breaks loose, stops": ((0.0, 3.0, 0.06, 0.05, NOWHERE), 2.0, 0.0, 0.7),
    "stops, slides, exchanges": ((0.5, -2.5, 0.2, 0.1, NOWHERE), 4.0, 0.05, 0.2),
    "onto ice": ((0.0, 3.0, 0.06, 0.05, 0.01), 2.0, 0.0, 0.5),
}


def numbers(model: BipedModel) -> list[jax.Array]:
    """The floating-point leaves of a model: what derivatives by a robot go through."""
    return [leaf for leaf in jax.tree.leaves(model) if leaf.dtype != bool]


def with_numbers(model: BipedModel, values: list[jax.Array]) -> BipedModel:
    """The model with other numbers in it; that it closes and is symmetric stands."""
    leaves, structure = jax.tree.flatten(model)
    source = iter(values)
    return structure.unflatten(leaf if leaf.dtype == bool else next(source) for leaf in leaves)


class Robot(NamedTuple):
    """The default robot with changed factors, and its numbers' derivatives by them, last axis."""

    model: BipedModel
    by_factors: list[jax.Array]


@jax.jit
def robot_of(factors: Float[Array, " 2"]) -> Robot:
    """Factors: on the hip's mass and the crank's length. A table as good as the exact functions."""

    def prepared(factors):
        params = BipedParams.from_bars()
        mass = jnp.asarray(params.mass).at[12].multiply(factors[0])
        changed = replace(params, mass=mass, crank=factors[1] * params.crank)
        model = prepare(changed, fidelity=Table(64, 9))
        return numbers(model), model

    by_factors, model = jax.jacfwd(prepared, has_aux=True)(factors)
    return Robot(model, by_factors)


@cache
def default_robot() -> Robot:
    """Both factors 1."""
    with jax.ensure_compile_time_eval():
        return robot_of(jnp.ones(2))


def default_model() -> BipedModel:
    """The default robot's."""
    return default_robot().model


def walk(spec: Integrator, inputs, phase, velocity, duration, robot: list[jax.Array]):
    """One call of `step`: OUTPUTS and instants of the first LOGGED, and how many there were."""
    torque, rate, static, kinetic, edge = inputs
    ice = jnp.asarray([1.0, 0.6])
    scene = Scene.patches(edge[None], static * ice, kinetic * ice, outputs="state")
    zero = jnp.zeros_like(phase)
    state = BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, velocity, zero)
    model = with_numbers(default_model(), robot)
    end, contact = step(model, scene, state, torque, duration, integrator=spec)
    found = [end.crank_angle, end.crank_rate, end.foot_position, end.foot_velocity]
    if contact.events is not None:
        found += list(contact.events.times[:LOGGED])
    return jnp.stack(found), contact.switches


class Derivatives(NamedTuple):
    """Of one walk; columns belong to INPUTS."""

    values: Float[Array, " outputs"]
    switches: Int[Array, ""]
    forward: Float[Array, "outputs inputs"]
    weighted: Float[Array, " inputs"]
    """Reverse mode: the gradient of weights @ values."""


@partial(jax.jit, static_argnums=0)
def derivatives(spec: Integrator, weights, inputs, phase, velocity, duration) -> Derivatives:
    """Outputs, number of switches, and derivatives forward and in reverse."""
    robot, by_robot = numbers(default_model()), default_robot().by_factors
    along_inputs = jnp.eye(len(INPUTS))[:, : len(inputs)]
    along_robot = [
        jnp.concatenate([jnp.zeros((len(inputs), *n.shape)), jnp.moveaxis(t, -1, 0)])
        for n, t in zip(robot, by_robot, strict=True)
    ]

    def end(inputs, robot):
        return walk(spec, inputs, phase, velocity, duration, robot)

    values, push, switches = jax.linearize(end, inputs, robot, has_aux=True)
    by_inputs, by_numbers = jax.linear_transpose(push, inputs, robot)(weights[: len(values)])
    pairs = zip(by_numbers, by_robot, strict=True)
    by_factors = sum(g.reshape(-1) @ t.reshape(g.size, -1) for g, t in pairs)
    return Derivatives(
        values,
        switches,
        jax.vmap(push, out_axes=1)(along_inputs, along_robot),
        jnp.concatenate([by_inputs, by_factors]),
    )


@partial(jax.jit, static_argnums=0)
def _values(spec: Integrator, inputs, phase, velocity, duration, robot):
    walks = jax.vmap(partial(walk, spec), (0, None, None, None, 0))
    return walks(inputs, phase, velocity, duration, robot)[0]


def differences(spec: Integrator, inputs, phase, velocity, duration, *, h: float = 1e-5):
    """Central differences of fourth order by INPUTS, one column each."""
    shifts = np.concatenate([s * h * np.eye(len(INPUTS)) for s in (-2, -1, 1, 2)])
    robots = [numbers(robot_of(jnp.asarray(1 + shift[5:])).model) for shift in shifts]
    shifted = jnp.asarray(inputs + shifts[:, :5])
    robots = [jnp.stack(column) for column in zip(*robots, strict=True)]
    at = np.asarray(_values(spec, shifted, phase, velocity, duration, robots))
    far_below, below, above, far_above = at.reshape(4, len(INPUTS), -1)
    return ((8 * (above - below) - (far_above - far_below)) / (12 * h)).T


def worst(got: np.ndarray, want: np.ndarray) -> np.ndarray:
    """Largest error of each output's derivatives, relative to the output's largest derivative."""
    scale = np.max(np.abs(want), axis=1)
    return np.max(np.abs(got - want), axis=1) / np.where(scale > 0, scale, 1.0)


pytestmark = pytest.mark.long

SPEC = EventExact(record_events=True)
SWITCHES = {
    "slides off, stops": 2,
    "breaks loose, stops": 2,
    "stops, slides, exchanges": 3,
    "onto ice": 2,
}
"""How many each walk has."""


@cache
def given(case: str) -> tuple[jax.Array, ...]:
    inputs, *start = CASES[case]
    return jnp.asarray(inputs), *map(jnp.asarray, start)


@cache
def weights() -> np.ndarray:
    return np.random.default_rng(3).normal(size=len(OUTPUTS) + LOGGED)


def derived(*start: jax.Array) -> Derivatives:
    return jax.tree.map(np.asarray, derivatives(SPEC, jnp.asarray(weights()), *start))


@cache
def of(case: str) -> Derivatives:
    return derived(*given(case))


@pytest.mark.parametrize("case", CASES)
def test_end_and_instants_have_the_derivatives_that_differences_show(float64, case):
    assert of(case).switches == SWITCHES[case]
    want = differences(SPEC, *given(case))
    assert np.any(want[len(OUTPUTS) + SWITCHES[case] - 1])  # the last switch's instant moves
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
