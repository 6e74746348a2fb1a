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
    BipedParams,
    BipedState,
    EventExact,
    RK4Split,
    Setting,
    check_walk,
    own_time,
    prepare,
    simulate,
)
from stickslip.dynamics.biped.walk_check import (
    FINE,
    NUDGE,
    Path,
    _parting,
    amplification,
    nudged,
    separation,
    walk_errors,
)
from tests.dynamics.biped.helpers import default_params, inertia_along, state_of

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
    true = Path(np.zeros((4, 3)), np.zeros((4, 3)), np.array([[0, 1, 3]] * 4), None, None)
    angle = np.array([[0.1, 0.2, 9.0], [0.1, 0.2, 9.0], [0.1, np.nan, 0.0], [0.0, 0.0, 9.0]])
    own = Path(angle, -angle, np.array([[0, 0, 0], [0, 3, 3], [0, 1, 1], [0, 0, 0]]), None, None)
    turned, slid = walk_errors(own, true)
    np.testing.assert_array_equal(turned, [0.2, np.inf, np.inf, 0.0])
    np.testing.assert_array_equal(slid, turned)


def test_walks_part_at_the_first_event_of_another_kind_or_of_one_only():
    same = [(0.1, 1), (0.2, 2)]
    assert _parting(same, [(0.11, 1), (0.2, 2)]) == np.inf
    assert _parting(same, [(0.1, 1), (0.15, 3), (0.2, 2)]) == 0.15
    assert _parting(same, same[:1]) == 0.2
    assert _parting([], same) == 0.1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"params": 0.03}, ("params = 0.03", "BipedParams")),
        ({"setting": "fats"}, ("'fats' is unknown", "did you mean fast?")),
        ({"duration": 0.0}, ("duration = 0.0",)),
        ({"period": -1.0}, ("period = -1.0",)),
        ({"torque": np.zeros(7), "period": 0.02}, ("torque has shape (7,)", "25 periods")),
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


def direct(state, integrator, fidelity):
    """Crank angles and slides of a walk, and its start, by `simulate` alone."""
    model = jax.jit(partial(prepare, fidelity=fidelity))(default_params())
    walk = jax.jit(
        lambda state: simulate(
            model, SLIPPERY, state, held_at_five, SECONDS, PERIOD, integrator=integrator
        )
    )(state)
    return np.asarray(walk.states.crank_angle), np.asarray(walk.states.foot_position)


@pytest.mark.long
def test_the_error_is_that_of_a_direct_comparison(float64):
    state = state_of(crank_rate=4.0)
    found = direct(state, RK4Split(substeps=2), "table")
    truth = direct(state, EventExact(rtol=1e-12, atol=1e-14), FINE)
    angle, slide = (np.max(np.abs(a - b)) for a, b in zip(found, truth, strict=True))
    one = check_walk(
        default_params(), SLIPPERY, state, held_at_five, SECONDS, COARSE, period=PERIOD
    )
    assert one.angle_error == pytest.approx(angle, rel=1e-3)
    assert one.slide_error == pytest.approx(slide, rel=1e-3)
    assert one.first_difference == np.inf
    assert one.status == one.reference_status
    assert one.reference_suffices
    assert not one.sensitive
    assert one.cost > 0


def test_separate_walks_are_measured_in_their_nudge(float64):
    """Half a step further and 3 mm ahead, of a crank of 30 mm: pi - 0.5 turned and 0.1 cranks."""
    one, other = state_of(phase=2.0, steps=4, foot_position=0.013), state_of(phase=2.5, steps=3)
    far = separation(one, replace(other, foot_position=0.010), 0.030)
    assert float(far) == pytest.approx(np.hypot(np.pi - 0.5, 0.1) / NUDGE, rel=1e-5)
    still = nudged(state_of(phase=4.6), 0.030, 0.055)
    assert float(still.phase) == pytest.approx(4.6 - NUDGE)  # inwards: 3 pi / 2 is the end
    assert float(still.foot_velocity) == 0.0


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


@pytest.mark.long
def test_a_small_robot_left_near_the_top_is_called_sensitive():
    """A crank of 11.6 mm at rest just beside its unstable equilibrium: errors grow like exp(t)."""
    with jax.enable_x64(True):
        params = BipedParams.from_bars(crank_length=0.0116, dtype=jnp.float64)
        angles = np.linspace(2.0, 4.3, 2001)
        height = np.asarray(inertia_along(params, angles).Y)
    top = angles[np.flatnonzero((height[:-1] > 0) & (height[1:] <= 0))[0]]
    scene = Scene.uniform(0.5, 0.4, outputs="state")
    starts = (
        BipedState(phase=float(top) + 2e-3, crank_rate=0.0),
        BipedState(phase=2.0, crank_rate=6.0),
    )
    setting = Setting("table", "rk4_split", 0.01, "float32")
    near, far = (check_walk(params, scene, at, 0.0, 0.7, setting, period=0.01) for at in starts)
    assert near.sensitive
    assert not far.sensitive
    assert near.sensitivity > 100 * far.sensitivity
    with jax.enable_x64(True):  # and two runs tell the same
        model = prepare(params, fidelity=FINE)
        for start, found in zip(starts, (near, far), strict=True):
            pair = start, nudged(start, params.crank, own_time(params))
            walks = [simulate(model, scene, at, 0.0, 0.7, 0.01).states for at in pair]
            grown = np.max(separation(*walks, params.crank))
            assert 0.2 * found.sensitivity < grown < 1.2 * found.sensitivity
    assert near.angle_error > 10 * far.angle_error
    assert not jax.config.read("jax_enable_x64")
    assert near.reference_angle_error < 1e-4  # in float64, whatever the setting's type
