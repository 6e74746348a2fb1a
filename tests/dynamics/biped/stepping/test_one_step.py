"""Single steps of Euler's scheme, taken again in NumPy; and what every step is made of."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import RK45

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import Euler, EventExact, step
from stickslip.dynamics.biped.stepping import adaptive
from tests.dynamics.biped.helpers import default_model, forward, state_of

MU = 0.5, 0.4
PHASE, RATE, SLIDE, TORQUE, SIZE = 2.5, 1.5, 0.02, 0.3, 0.004
VELOCITIES = 0.2, -0.2
"""Of feet that still slide after such a step, forwards and backwards [m/s]."""


@partial(jax.jit, static_argnums=0)
def _step(integrator, model, velocity, size):
    begin = state_of(phase=PHASE, crank_rate=RATE, foot_position=SLIDE, foot_velocity=velocity)
    return step(model, Scene.uniform(*MU), begin, TORQUE, size, integrator=integrator)


def stepped(velocity: float, size: float = SIZE):
    """Angle, rate, slide and velocity of the foot after a step; the way slid; the work."""
    after, contact = _step(Euler(), default_model(), jnp.asarray(velocity), jnp.asarray(size))
    place = after.phase, after.crank_rate, after.foot_position, after.foot_velocity
    return np.array(place), float(contact.slide_distance), float(contact.work)


def slope(place: np.ndarray, way: float) -> np.ndarray:
    """From the forces at an instant, which depend on no more than which way the foot slides."""
    angle, rate, _, velocity = place
    now = forward(default_model(), angle, rate, way, TORQUE, *MU)
    return np.array([rate, float(now.crank_acceleration), velocity, float(now.foot_acceleration)])


def evenly_accelerated(place: np.ndarray, size: float) -> np.ndarray:
    now = slope(place, place[3])
    after = place + size * now
    after[[0, 2]] += size**2 / 2 * now[[1, 3]]
    return after


@pytest.mark.parametrize("velocity", VELOCITIES)
def test_a_step_of_a_sliding_foot_is_the_scheme_s(float64, velocity):
    want = evenly_accelerated(np.array([PHASE, RATE, SLIDE, velocity]), SIZE)
    assert want[3] * velocity > 0
    found, way, work = stepped(velocity)
    np.testing.assert_allclose(found, want, rtol=1e-11)
    assert way == pytest.approx(abs(want[2] - SLIDE), rel=1e-9)
    assert work == pytest.approx(TORQUE * (want[0] - PHASE), rel=1e-9)


@pytest.mark.parametrize("velocity", [1e-3, -1e-3])
def test_a_foot_that_would_turn_back_stops_after_v_squared_over_2_a(float64, velocity):
    """Eq. (36); the rest of the step is taken from rest."""
    place = np.array([PHASE, RATE, SLIDE, velocity])
    foot = slope(place, velocity)[3]
    until = -velocity / foot
    assert 0 < until < SIZE
    stop = SLIDE - velocity**2 / (2 * foot)
    found, way, _ = stepped(velocity)
    assert found[2] == pytest.approx(stop, rel=1e-12)
    assert way == pytest.approx(abs(stop - SLIDE), rel=1e-9)
    assert found[3] == 0
    rest = evenly_accelerated(place, until)
    rest[3] = 0.0
    want = evenly_accelerated(rest, SIZE - until)
    np.testing.assert_allclose(found[:2], want[:2], rtol=1e-11)


def test_dormand_and_prince_s_rows_are_scipys():
    """Seven stages, the error, and the interpolant at the midpoint."""
    count = len(RK45.C)
    np.testing.assert_allclose(adaptive.TABLEAU[:count, : RK45.A.shape[1]], RK45.A, rtol=1e-14)
    np.testing.assert_allclose(adaptive.TABLEAU[count, :count], RK45.B, rtol=1e-14)
    np.testing.assert_allclose(adaptive.ERROR[: count + 1], -RK45.E, rtol=1e-13)
    halfway = RK45.P @ 0.5 ** np.arange(1, 5)
    np.testing.assert_allclose(adaptive.TABLEAU[-1, : count + 1], halfway, atol=1e-8)


@pytest.mark.long
def test_an_adaptive_call_may_end_just_behind_any_event(float64):
    """By parts of its length from 1e-9 on: a stop, an edge of the floor, an exchange, a fall."""
    floor = Scene.patches((0.0201,), (0.06, 0.5), (0.05, 0.45))
    begins = [
        {"phase": 4.0, "crank_rate": 3.0, "foot_velocity": 0.01},
        {"phase": 4.0, "crank_rate": 3.0, "foot_velocity": 0.05, "foot_position": 0.02},
        {"phase": 4.70, "crank_rate": 3.0, "foot_position": 0.05},
        {"phase": 3.0, "crank_rate": 2.0, "foot_position": 0.05},
    ]
    begins = jax.tree.map(lambda *one: jnp.stack(one), *(state_of(**one) for one in begins))
    how = {"integrator": EventExact(max_steps=64, record_events=True)}
    each = jax.jit(jax.vmap(lambda *at: step(default_model(), floor, *at, **how)))
    torques = jnp.array([0.5, 0.5, 0.5, 10.0])
    after, contact = each(begins, torques, jnp.full(4, 0.1))
    assert contact.status[3] == Status.TOPPLE
    ends = after.time.at[:3].set(contact.events.times[:3, 0])
    for part in np.geomspace(1e-9, 1e-2, 60):
        after, contact = each(begins, torques, ends * (1 + part))
        assert np.all(contact.status != Status.NOT_CONVERGED), part
        np.testing.assert_allclose(contact.events.times[:3, 0], ends[:3], rtol=1e-9)
        np.testing.assert_allclose(after.time[3], ends[3], rtol=1e-9)
