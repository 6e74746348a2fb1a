"""Derivatives of walks, forward and reverse, away from switches and through them.

Every case is one row of inputs to one compiled roll-out; the reference is a central difference.
"""

from dataclasses import replace
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedState, step
from tests.dynamics.biped.helpers import default_model, default_params, model_of, outcome

pytestmark = pytest.mark.long

STEPS = 40
ROBOT = ("hip", "crank")
"""Factors on the hip's mass and on the crank's length alone: both go through the table's fit."""

INPUTS = ("torque", "phase", "rate", "position", "velocity", "static", "kinetic", *ROBOT)

CASES = {
    # name: (torque, phase, rate, position, velocity, mu_static, mu_kinetic, duration), events
    "sticking": ((1.0, np.pi / 2, 0.0, 0.0, 0.0, 0.5, 0.4, 0.5), 0),
    "slides off and stops": ((1.2, np.pi / 2, 0.0, 0.0, 0.0, 0.15, 0.12, 0.3), 2),
    "breaks loose": ((0.0, 2.0, 3.0, 0.0, 0.0, 0.06, 0.05, 0.3), 1),
    "breaks loose and stops": ((0.0, 2.0, 3.0, 0.0, 0.0, 0.06, 0.05, 0.7), 2),
    "stops, slides, exchanges": ((0.5, 4.0, -2.5, 0.0, 0.05, 0.2, 0.1, 0.2), 3),
    "walks over, sticking": ((1.0, 4.5, 5.0, 0.0, 0.0, 5.0, 5.0, 0.1), 1),
    "slips, stops, walks over": ((1.0, np.pi / 2, 0.0, 0.0, 0.0, 0.5, 0.4, 0.8), 4),
}


def numbers_of(factors: jax.Array) -> list[jax.Array]:
    """The floating-point leaves of the prepared model of a changed robot."""
    hip, crank = factors
    params = default_params()
    mass = params.mass.at[12].multiply(hip)
    model = model_of(replace(params, mass=mass, crank=crank * params.crank))
    return [leaf for leaf in jax.tree.leaves(model) if leaf.dtype != bool]


def model_with(numbers: list[jax.Array]):
    """The default model with other numbers in it; that it closes and is symmetric stands."""
    leaves, structure = jax.tree.flatten(default_model())
    source = iter(numbers)
    return structure.unflatten(leaf if leaf.dtype == bool else next(source) for leaf in leaves)


def roll_out(row, numbers, duration):
    """State after STEPS steps, and how many switches they took."""
    torque, phase, rate, position, velocity, static, kinetic = row
    model = model_with(numbers)
    scene = Scene.uniform(static, kinetic, outputs="state")
    steps, time = jnp.zeros((), jnp.int32), jnp.zeros_like(phase)
    state = BipedState(phase, steps, rate, position, velocity, time)

    def body(now, _):
        after, contact = step(model, scene, now, torque, duration / STEPS)
        return after, contact.switches

    final, switches = jax.lax.scan(body, state, None, length=STEPS)
    return outcome(final), jnp.sum(switches)


def rows() -> tuple[jax.Array, jax.Array]:
    table = jnp.asarray([row for row, _ in CASES.values()])
    return table[:, :-1], table[:, -1]


value = jax.jit(jax.vmap(roll_out, in_axes=(0, None, 0)))


@jax.jit
def forward(row, numbers, row_tangents, number_tangents, duration):
    """One column for every tangent."""

    def push(along_row, along_numbers):
        end = lambda r, n: roll_out(r, n, duration)[0]  # noqa: E731
        return jax.jvp(end, (row, numbers), (along_row, along_numbers))[1]

    return jax.vmap(push, out_axes=1)(row_tangents, number_tangents)


@jax.jit
def reverse(row, numbers, number_tangents, duration):
    """One row for every output; the robot's part is the gradient by the model along its change."""
    by_row, by_numbers = jax.jacrev(lambda r, n: roll_out(r, n, duration)[0], (0, 1))(row, numbers)
    along = lambda g, t: jnp.einsum("o...,r...->or", g, t[-len(ROBOT) :])  # noqa: E731
    return jnp.concatenate([by_row, sum(map(along, by_numbers, number_tangents))], axis=1)


def differences(inputs, durations, h=1e-5) -> np.ndarray:
    """Central differences of fourth order, input by input."""
    ones, columns = jnp.ones(len(ROBOT)), []
    for index in range(len(INPUTS)):
        push = h * np.eye(len(INPUTS))[index]
        at = {
            s: value(inputs + s * push[:7], numbers_of(ones + s * push[7:]), durations)[0]
            for s in (-2, -1, 1, 2)
        }
        columns.append((8 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12 * h))
    return np.stack(columns, axis=-1)


@lru_cache
def jacobians() -> tuple[np.ndarray, ...]:
    """(cases, outputs, inputs): forward, reverse, by differences; and the numbers of switches."""
    inputs, durations = rows()
    ones = jnp.ones(len(ROBOT))
    numbers, by_robot = numbers_of(ones), jax.jit(jax.jacfwd(numbers_of))(ones)
    row_tangents = jnp.eye(len(INPUTS))[:, : inputs.shape[1]]
    number_tangents = [
        jnp.concatenate([jnp.zeros((inputs.shape[1], *n.shape)), jnp.moveaxis(t, -1, 0)])
        for n, t in zip(numbers, by_robot, strict=True)
    ]
    ahead = jax.vmap(forward, (0, None, None, None, 0))(
        inputs, numbers, row_tangents, number_tangents, durations
    )
    back = jax.vmap(reverse, (0, None, None, 0))(inputs, numbers, number_tangents, durations)
    switches = value(inputs, numbers, durations)[1]
    results = (ahead, back, differences(inputs, durations), switches)
    return tuple(map(np.asarray, results))


def scaled_error(got, want) -> float:
    """Largest difference, row by row to the row's largest entry."""
    scale = np.max(np.abs(want), axis=-1, keepdims=True)
    return np.max(np.abs(got - want) / np.where(scale > 0, scale, 1.0))


@pytest.mark.parametrize("name", CASES)
def test_cases_switch_as_they_say(float64, name):
    assert jacobians()[3][list(CASES).index(name)] == CASES[name][1]


def comparable(name: str) -> list[int]:
    """Inputs by which differences exist: not by the velocity of a foot at rest, which either sign
    would set sliding, nor by the phase where it touches the end of its range."""
    row = rows()[0][list(CASES).index(name)]
    out = {"velocity"} if row[INPUTS.index("velocity")] == 0 else set()
    out |= {"phase"} if row[INPUTS.index("phase")] == np.pi / 2 else set()
    return [index for index, label in enumerate(INPUTS) if label not in out]


@pytest.mark.parametrize("name", CASES)
def test_forward_derivatives_match_differences_through_switches(float64, name):
    index, use = list(CASES).index(name), comparable(name)
    ahead, _, slopes, _ = jacobians()
    assert scaled_error(ahead[index][:, use], slopes[index][:, use]) < 1e-6


@pytest.mark.parametrize("name", ["sticking", "walks over, sticking"])
def test_a_foot_that_sticks_throughout_feels_nothing(float64, name):
    ahead = jacobians()[0][list(CASES).index(name)]
    for label in comparable(name):
        column = ahead[:, label]
        assert column[2] == (INPUTS[label] == "position")
        assert column[3] == 0


@pytest.mark.parametrize("name", CASES)
def test_reverse_derivatives_are_the_forward_ones(float64, name):
    index = list(CASES).index(name)
    ahead, back, *_ = jacobians()
    assert np.all(np.isfinite(back[index]))
    assert scaled_error(back[index], ahead[index]) < 1e-10
