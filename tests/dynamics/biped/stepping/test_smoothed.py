"""Smoothed friction: what it is, how far it is from dry friction, what it asks of a step.

The compiled walks are those of benchmarks/smoothed.py.
"""

import math
from functools import lru_cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import gradients, smoothed
from benchmarks.smoothed import WALKS
from stickslip.dynamics import Scene
from stickslip.dynamics.biped import EventExact, forward_dynamics, step
from stickslip.dynamics.status import Status
from tests.dynamics.biped.helpers import default_model, state_of

pytestmark = pytest.mark.long

EXACT = EventExact(record_events=True)
SLIDES = [name for name in WALKS if name != "dry friction holds"]


@lru_cache
def how(name: str, slip_speed: float) -> tuple:
    """A walk's numbers, and how it is rolled out."""
    torque, phase, rate, mu, duration = WALKS[name]
    count = math.ceil(duration / smoothed.fine_step(mu, slip_speed))
    numbers = jnp.asarray([torque, rate, mu])
    return numbers, (
        jnp.asarray(phase),
        jnp.asarray(slip_speed),
        jnp.asarray(duration / count),
        count,
    )


@lru_cache
def dry(name: str) -> tuple[np.ndarray, np.ndarray]:
    return smoothed.dry(*WALKS[name], spec=EXACT)


def end_of(name: str, slip_speed: float) -> np.ndarray:
    numbers, rest = how(name, slip_speed)
    return np.asarray(smoothed.roll(numbers, *rest)[0])


@lru_cache
def slopes_of(name: str, slip_speed: float) -> np.ndarray:
    numbers, rest = how(name, slip_speed)
    return np.asarray(smoothed.slopes(numbers, *rest))


@pytest.mark.parametrize("velocity", [0.0, 0.004, -0.004, 0.5])
def test_friction_is_the_hyperbolic_tangent_of_the_sliding_speed(dtype, velocity):
    model = default_model("table", dtype.name)
    scene = Scene.smoothed(jnp.asarray(0.1, dtype), jnp.asarray(0.01, dtype))
    state = state_of(dtype.name, phase=2.5, crank_rate=1.0, foot_velocity=velocity)
    after, contact = step(model, scene, state, jnp.asarray(0.5, dtype), jnp.asarray(1e-3, dtype))
    assert contact.friction_force.dtype == dtype
    want = -0.1 * contact.normal_force * np.tanh(float(after.foot_velocity) / 0.01)
    np.testing.assert_allclose(contact.friction_force, want, rtol=2e-5)
    assert contact.status == Status.OK  # never SLIP_ONSET: there is no rest to leave
    assert contact.switches == 0
    slides = abs(float(after.foot_velocity)) > 0.01
    assert int(contact.mode) == (np.sign(velocity) if slides else 0)


@pytest.mark.long
def test_a_foot_that_dry_friction_holds_creeps_at_slip_speed_artanh_of_its_use(float64):
    name, slip_speed = "dry friction holds", 1e-3
    mu = WALKS[name][3]
    numbers, (phase, speed, size, _) = how(name, slip_speed)
    end = smoothed.roll(numbers, phase, speed, size, math.ceil(0.3 / float(size)))[1]
    zero, coefficient = jnp.zeros(()), jnp.asarray(mu)
    at = (end.crank_angle, end.crank_rate, zero, numbers[0], coefficient, coefficient)
    still = jax.jit(forward_dynamics)(default_model(), *at)
    use = float(still.friction_force / (mu * still.normal_force))
    assert 0.1 < abs(use) < 1
    assert float(end.foot_velocity) == pytest.approx(-slip_speed * math.atanh(use), rel=2e-3)


@pytest.mark.long
@pytest.mark.parametrize("name", WALKS)
def test_the_error_falls_in_proportion_to_the_slip_speed(float64, name):
    coarse, fine = (np.abs(end_of(name, speed) - dry(name)[0]) for speed in (3e-3, 1e-3))
    assert np.all(fine > 0)
    assert np.all((coarse / fine > 2) & (coarse / fine < 3.5))
    assert fine[0] < 3e-3
    assert fine[1] < 1e-4


@pytest.mark.parametrize("name", SLIDES)
def test_derivatives_tend_to_those_of_hard_switching(float64, name):
    hard = dry(name)[1]
    scale = np.max(np.abs(hard), axis=1, keepdims=True)
    coarse, fine = (np.max(np.abs(slopes_of(name, speed) - hard) / scale) for speed in (3e-3, 1e-3))
    assert 2 < coarse / fine < 3.5
    assert fine < 1e-2


@pytest.mark.parametrize("name", WALKS)
def test_derivatives_match_differences(float64, name):
    numbers, rest = how(name, 3e-3)
    want = smoothed.differences(lambda at: smoothed.roll(at, *rest)[0], numbers, 1e-5)
    got = slopes_of(name, 3e-3)
    assert gradients.worst(got, want).max() < 1e-6


@pytest.mark.parametrize("integrator", ["euler", "semi_implicit", "rk4_split"])
def test_creep_decays_below_the_largest_step_and_grows_above_it(float64, integrator):
    """Steps in units of slip_speed / (mu g), over the factor M m / (M m - P^2)."""
    model, mu, slip_speed = default_model(), 0.1, 1e-4
    for phase in (0.55 * np.pi, 0.665 * np.pi, np.pi):
        M, _, P, *_ = jax.jit(model.inertia.at)(jnp.asarray(phase))
        factor = float(M * model.total_mass / (M * model.total_mass - P**2))
        unit = slip_speed / (mu * float(model.gravity)) / factor
        left = [
            float(
                smoothed.creep_left(
                    integrator,
                    jnp.asarray(phase),
                    jnp.asarray(slip_speed),
                    jnp.asarray(mu),
                    jnp.asarray(share * smoothed.STABLE[integrator] * unit),
                )
            )
            for share in (0.97, 1.03)
        ]
        assert left[0] < 0.5
        assert left[1] > 2


def test_beyond_the_largest_step_creep_stays_bounded_but_is_wrong(float64):
    """The force saturates: the foot shakes by what mu g can do in one step, and no more."""
    model, size = default_model(), 0.01
    torque = jnp.asarray(1.0)
    scene = Scene.smoothed(jnp.asarray(0.5), jnp.asarray(1e-4), outputs="state")
    state, speeds = state_of(phase=np.pi / 2), []
    for _ in range(40):
        state, contact = step(model, scene, state, torque, jnp.asarray(size))
        speeds.append(abs(float(state.foot_velocity)))
        assert contact.status == Status.OK
    phases = jnp.linspace(np.pi / 2, 3 * np.pi / 2, 101)
    factor = float(jnp.max(jax.vmap(smoothed.decay_factor)(phases)))
    assert 1e-2 < max(speeds) < 2 * 0.5 * float(model.gravity) * size * factor
