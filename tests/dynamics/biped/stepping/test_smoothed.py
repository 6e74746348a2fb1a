"""Smoothed friction: what it is, how far it is from dry friction, the largest stable step."""

import math
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import RK4, BipedState, EventExact, step
from stickslip.dynamics.status import Status
from tests.dynamics.biped.helpers import default_model, state_of

pytestmark = pytest.mark.long

WALKS = {
    # torque, phase, crank rate, coefficient (static and kinetic), duration
    "dry friction holds": (1.0, np.pi / 2, 0.0, 0.5, 0.5),
    "slides off, stops": (1.2, np.pi / 2, 0.0, 0.12, 0.3),
    "breaks loose, stops": (0.0, 2.0, 3.0, 0.05, 0.7),
}
STABLE = {"euler": 2.0, "semi_implicit": 2.0, "rk4_split": 2.785}
"""Largest decay rate times step of each scheme: the end of its real stability interval."""


def decay_factor(angle):
    """Decay rate of creep over mu g / slip_speed: M m / (M m - P^2)."""
    inertia, mass = default_model().inertia.at(angle), default_model().total_mass
    return inertia.M * mass / (inertia.M * mass - inertia.P**2)


def fine_step(mu: float, slip_speed: float) -> float:
    """Step of 1.5 decay times of creep at the lightest phase [s]."""
    angles = jnp.linspace(np.pi / 2, 3 * np.pi / 2, 401)
    fastest = float(jnp.max(jax.vmap(decay_factor)(angles)))
    return min(1e-3, 1.5 * slip_speed / (mu * float(default_model().gravity) * fastest))


@jax.jit
def roll(numbers, phase, slip_speed, size, count):
    """Crank angle and slide after `count` steps of `size` [s] with smoothed friction."""
    torque, rate, mu = numbers
    scene = Scene.smoothed(mu, slip_speed, outputs="state")
    zero = jnp.zeros_like(phase)
    state = BipedState(phase, jnp.zeros((), jnp.int32), rate, zero, zero, zero)

    def body(_, now):
        return step(default_model(), scene, now, torque, size, integrator=RK4())[0]

    end = jax.lax.fori_loop(0, count, body, state)
    return jnp.stack([end.crank_angle, end.foot_position])


@lru_cache
def given(name: str, slip_speed: float) -> tuple:
    """A walk's numbers, and the other arguments of `roll`."""
    torque, phase, rate, mu, duration = WALKS[name]
    count = math.ceil(duration / fine_step(mu, slip_speed))
    rest = (phase, slip_speed, duration / count)
    return jnp.asarray([torque, rate, mu]), (*map(jnp.asarray, rest), count)


@lru_cache
def dry(name: str) -> np.ndarray:
    """Crank angle and slide with dry friction, mu static = mu kinetic."""
    torque, phase, rate, mu, duration = WALKS[name]
    scene, state = Scene.uniform(mu, mu, outputs="state"), state_of(phase=phase, crank_rate=rate)
    end, _ = step(default_model(), scene, state, torque, duration, integrator=EventExact())
    return np.asarray([end.crank_angle, end.foot_position])


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


@pytest.mark.parametrize("name", WALKS)
def test_the_error_falls_in_proportion_to_the_slip_speed(float64, name):
    def off(slip_speed):
        numbers, rest = given(name, slip_speed)
        return np.abs(np.asarray(roll(numbers, *rest)) - dry(name))

    coarse, fine = off(3e-3), off(1e-3)
    assert np.all(fine > 0)
    assert np.all((coarse / fine > 2) & (coarse / fine < 3.5))
    assert fine[0] < 3e-3
    assert fine[1] < 1e-4


@pytest.mark.parametrize("name", ["slides off, stops", "breaks loose, stops"])
def test_derivatives_tend_to_those_of_dry_friction(float64, name):
    """Of crank angle and slide by the torque; the dry ones go through the switches."""
    torque, phase, rate, mu, duration = WALKS[name]
    state = state_of(phase=phase, crank_rate=rate)

    def dry_end(torque):
        scene = Scene.uniform(mu, mu, outputs="state")
        end, _ = step(default_model(), scene, state, torque, duration, integrator=EventExact())
        return jnp.stack([end.crank_angle, end.foot_position])

    want = np.asarray(jax.jit(jax.jacfwd(dry_end))(jnp.asarray(torque)))

    def off(slip_speed):
        numbers, rest = given(name, slip_speed)
        found = jax.jvp(lambda at: roll(at, *rest), (numbers,), (jnp.eye(3)[0],))[1]
        return np.abs(np.asarray(found) - want) / np.abs(want)

    coarse, fine = off(3e-3), off(1e-3)
    assert np.all((fine < coarse / 2) | (fine < 1e-5))  # an angle that friction hardly changes
    assert np.all(fine < 0.05)


@partial(jax.jit, static_argnums=0)
def creep_left(integrator: str, phase, slip_speed, mu, size):
    """Creep after 60 steps over that at the start, on a robot held by its motor."""
    model = default_model()
    torque = model.gravity * model.inertia.at(phase).Y
    scene = Scene.smoothed(mu, slip_speed, outputs="state")
    zero = jnp.zeros_like(phase)
    begin = 1e-3 * slip_speed
    state = BipedState(phase, jnp.zeros((), jnp.int32), zero, zero, begin, zero)

    def body(_, now):
        return step(model, scene, now, torque, size, integrator=integrator)[0]

    return jnp.abs(jax.lax.fori_loop(0, 60, body, state).foot_velocity) / begin


@pytest.mark.parametrize("integrator", STABLE)
def test_creep_decays_below_the_largest_step_and_grows_above_it(float64, integrator):
    """Steps in units of slip_speed / (mu g), over the factor M m / (M m - P^2)."""
    mu, slip_speed = 0.1, 1e-4
    for phase in (0.55 * np.pi, 0.665 * np.pi, np.pi):
        unit = slip_speed / (mu * float(default_model().gravity)) / float(decay_factor(phase))
        sizes = (share * STABLE[integrator] * unit for share in (0.97, 1.03))
        numbers = [(phase, slip_speed, mu, size) for size in sizes]
        below, above = (float(creep_left(integrator, *map(jnp.asarray, one))) for one in numbers)
        assert below < 0.5
        assert above > 2
