"""One's own walk at a setting beside the event-exact one: error, sensitivity, cost."""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    BipedState,
    EventExact,
    Setting,
    check_walk,
    own_time,
    prepare,
    simulate,
)
from stickslip.dynamics.biped.walk_check import (
    FINE,
    Path,
    amplification,
    walk_errors,
)
from tests.dynamics.biped.helpers import default_params, state_of

COARSE = Setting("table", "rk4_split", 0.01, "float64")
SLIPPERY = Scene.uniform(0.06, 0.05)
PERIOD, SECONDS = 0.02, 0.5


def held_at_five(state):
    return 0.5 * (5.0 - state.crank_rate)


class Line(NamedTuple):
    """A walk that is linear in its start."""

    angle: jax.Array
    slide: jax.Array


def test_the_sensitivity_is_the_largest_singular_value():
    rng = np.random.default_rng(3)
    matrix, length, time = rng.normal(size=(5, 2, 4)), 0.03, 0.055
    state = state_of("float32", phase=2.0, crank_rate=3.0, foot_velocity=0.1)

    def linear(state, still=False):
        start = jnp.stack([state.phase, state.crank_rate * time, state.foot_position / length])
        start = jnp.append(start, state.foot_velocity * time / length)
        out = jnp.asarray(matrix, "float32") @ start
        return Line(out[:, 0], out[:, 1] * length)

    _, found = amplification(linear, state, length, time)
    np.testing.assert_allclose(found, np.linalg.norm(matrix, 2, axis=(1, 2)), rtol=1e-5)
    rest = replace(state, foot_velocity=jnp.zeros(()))
    _, found = amplification(linear, rest, length, time)
    np.testing.assert_allclose(found, np.linalg.norm(matrix[:, :, :3], 2, axis=(1, 2)), rtol=1e-5)
    _, found = amplification(linear, rest, length, time, slips_freely=True)
    np.testing.assert_allclose(found, np.linalg.norm(matrix, 2, axis=(1, 2)), rtol=1e-5)


def test_errors_count_while_the_reference_is_inside_and_an_early_end_is_infinitely_wrong():
    true = Path(np.zeros((4, 3)), np.zeros((4, 3)), np.array([[0, 1, 3]] * 4))
    angle = np.array([[0.1, 0.2, 9.0], [0.1, 0.2, 9.0], [0.1, np.nan, 0.0], [0.0, 0.0, 9.0]])
    own = Path(angle, -angle, np.array([[0, 0, 0], [0, 3, 3], [0, 1, 1], [0, 0, 0]]))
    turned, slid = walk_errors(own, true)
    np.testing.assert_array_equal(turned, [0.2, np.inf, np.inf, 0.0])
    np.testing.assert_array_equal(slid, turned)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"params": 0.03}, ("params = 0.03", "BipedParams")),
        ({"setting": "fats"}, ("'fats' is unknown", "did you mean fast?")),
        ({"duration": 0.0}, ("duration = 0.0",)),
        ({"period": -1.0}, ("period = -1.0",)),
        ({"torque": np.zeros(7), "period": 0.02}, ("torque has shape (7,)", "25 steps")),
        ({"torque": np.zeros((2, 25)), "period": 0.02}, ("torque has shape (2, 25)",)),
        ({"state": BipedState(crank_rate=np.ones(3))}, ("crank_rate has shape (3,)",)),
        ({"scene": Scene.grip(), "state": BipedState(foot_velocity=0.1)}, ("foot_velocity",)),
    ],
)
def test_bad_questions_are_refused(changes, words):
    given = {
        "params": default_params("float32"),
        "scene": SLIPPERY,
        "state": BipedState(crank_rate=3.0),
        "torque": 0.5,
        "duration": SECONDS,
    } | changes
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        check_walk(**given)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.long
def test_the_sensitivity_is_that_of_finite_differences(float64):
    params, h = default_params(), 1e-6
    length, time = float(params.crank), float(own_time(params))
    start = state_of(phase=2.0, crank_rate=4.0, foot_velocity=0.05)
    torque = np.linspace(0.2, 0.6, 25)
    found = check_walk(params, SLIPPERY, start, torque, SECONDS, COARSE)
    model = jax.jit(partial(prepare, fidelity=FINE))(params)

    @jax.vmap
    def end(by):
        state = replace(
            start,
            phase=start.phase + by[0],
            crank_rate=start.crank_rate + by[1] / time,
            foot_position=start.foot_position + by[2] * length,
            foot_velocity=start.foot_velocity + by[3] * length / time,
        )
        exact = EventExact(rtol=1e-12, atol=1e-15)
        walk = simulate(
            model, SLIPPERY, state, jnp.asarray(torque), SECONDS, PERIOD, integrator=exact
        )
        return jnp.stack([walk.states.crank_angle, walk.states.foot_position / length], axis=-1)

    walks = np.asarray(jax.jit(end)(h * jnp.concatenate([jnp.eye(4), -jnp.eye(4)])))
    slopes = np.moveaxis((walks[:4] - walks[4:]) / (2 * h), 0, -1)[1:]
    expected = np.max(np.linalg.norm(slopes, 2, axis=(1, 2)))
    assert found.sensitivity == pytest.approx(expected, rel=1e-4)
    assert not found.sensitive
    assert found.reference_angle_error <= 0.1 * found.angle_error
    assert found.cost > 0
