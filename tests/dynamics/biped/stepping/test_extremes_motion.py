"""Starting anywhere, at any rate, torque and time step: a named end, finite numbers, no gifts."""

from collections import Counter
from dataclasses import replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import Scene, Status
from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, step
from tests.dynamics.biped.helpers import (
    default_model,
    default_params,
    inertia_along,
    inverse,
    state_of,
)
from tests.dynamics.biped.stepping.marching import March, Start, march
from tests.dynamics.biped.stepping.test_extremes_friction import long_footed, momentum_and_energy

pytestmark = pytest.mark.long

LIFT_OFF_RATE = 8.6238
"""At constant crank speed [rad/s]: where m g + Y' w^2 first vanishes, at 1.035 pi."""

UNSPLIT = ("euler", "semi_implicit", "rk4")


def anywhere(count: int = 960) -> list[Start]:
    """Random starts: rates to 1e3 rad/s, slides to 100 m/s, torques to 10 kN m, steps to 0.1 s."""
    rng = np.random.default_rng(0)

    def spread(low: float, high: float, every: int) -> np.ndarray:
        value = rng.choice([-1, 1], count) * 10 ** rng.uniform(low, high, count)
        value[rng.permutation(count)[: count // every]] = 0.0
        return value

    phase = rng.uniform(SUPPORT_START, SUPPORT_END, count)
    phase[::7], phase[3::7] = SUPPORT_START, SUPPORT_END
    mu_static = np.abs(spread(-12, 2, 9))
    columns = {
        "mu_static": mu_static,
        "mu_kinetic": mu_static * rng.choice([0.0, 0.5, 1.0], count),
        "phase": phase,
        "crank_rate": spread(-3, 3, 5),
        "foot_velocity": spread(-9, 2, 3),
        "torque": spread(-3, 4, 6),
        "dt": 10 ** rng.uniform(-6, -1, count),
    }
    return [
        replace(Start(count=20), **dict[str, Any](zip(columns, map(float, row), strict=True)))
        for row in zip(*columns.values(), strict=True)
    ]


@lru_cache
def marched(dtype: str, integrator: str = "rk4_split") -> March:
    return march(anywhere(), long_footed(dtype), jnp.dtype(dtype), integrator)


def assert_named_and_sound(end: March):
    assert np.all(end.sound)
    runs = end.contact.status <= Status.SLIP_ONSET
    assert np.all(end.calls[runs] == 20)
    wanted = np.array([20 * start.dt for start in anywhere()])
    np.testing.assert_allclose(end.state.time[runs], wanted[runs], rtol=1e-5)
    assert np.all(end.state.time <= wanted * (1 + 1e-5))
    assert np.all(end.contact.normal_force[runs] > 0)
    velocity = end.state.foot_velocity
    assert np.all((end.contact.mode == np.sign(velocity))[runs & (velocity != 0)])
    names = {"OK", "SLIP_ONSET", "TOPPLE", "LIFT_OFF", "NO_SOLUTION", "NOT_CONVERGED"}
    assert {status.name for status in end.status} <= names
    toppled = [status.name == "TOPPLE" for status in end.status]
    if any(toppled):  # as N goes to 0 the ZMP leaves any foot, one of a kilometre just before
        assert np.mean(np.abs(np.abs(end.contact.zmp[toppled]) - 1e3) < 200) > 0.9


def test_a_walk_from_anywhere_ends_named_and_finite(dtype):
    end = marched(dtype.name)
    assert_named_and_sound(end)
    met = Counter(status.name for status in end.status)
    assert min(met[name] for name in ("OK", "LIFT_OFF", "NOT_CONVERGED", "NO_SOLUTION")) >= 10
    assert end.most_switches.max() <= 13


def test_both_precisions_name_the_same_ends(float64):
    with jax.enable_x64(False):
        single = marched("float32")
    same = [a == b for a, b in zip(single.status, marched("float64").status, strict=True)]
    assert np.mean(same) > 0.98


@pytest.mark.long
@pytest.mark.parametrize("integrator", [*UNSPLIT, "event_exact"])
def test_every_integrator_ends_named_and_finite_in_double_precision(float64, integrator):
    assert_named_and_sound(marched("float64", integrator))


def within_the_model() -> list[Start]:
    """Rates up to lift-off, torques to 3 N m, any friction; 0.1 s in steps of 0.1 ms."""
    rng, count = np.random.default_rng(1), 96
    velocity = rng.choice([-1, 1], count) * 10 ** rng.uniform(-9, 0, count)
    velocity[1::3] = 0.0
    mu = 10 ** rng.uniform(-12, 0.5, count)
    mu[::4] = 0.0
    columns = [mu, mu * rng.choice([0.0, 0.5, 1.0], count), rng.uniform(1.6, 4.7, count)]
    columns += [rng.uniform(-9, 9, count), velocity, rng.uniform(-3, 3, count)]
    return [Start(*map(float, row), dt=1e-4, count=1000) for row in zip(*columns, strict=True)]


def test_energy_is_never_given_away(float64):
    """Friction only takes: kinetic and potential energy grow by no more than the motor's work."""
    starts = within_the_model()
    end = march(starts, long_footed("float64"), float64)
    assert np.all(end.sound)
    names = ("phase", "crank_rate", "foot_velocity")
    _, before = momentum_and_energy(*([getattr(one, name) for one in starts] for name in names))
    _, after = momentum_and_energy(*(getattr(end.state, name) for name in names))
    gained = after - before - end.work
    assert gained.max() < 1e-7
    assert gained.min() < -1.0  # and friction does take
    glides = np.array([one.mu_kinetic == 0 and one.mu_static == 0 for one in starts])
    assert np.max(np.abs(gained[glides])) < 1e-7


@pytest.mark.parametrize("direction", [1, -1])
def test_constant_crank_speed_lifts_off_at_the_known_rate(float64, direction):
    """On a floor without slip; a foot that can slip does so first, since its cone closes."""
    params, angles = default_params(), np.linspace(SUPPORT_START, SUPPORT_END, 4001)
    _, _, _, _, _, dY = inertia_along(params, angles)
    phase = angles[dY.argmin()]
    weight = float(params.total_mass) * float(np.asarray(params.gravity))
    rate = np.sqrt(weight / -dY.min())
    assert rate == pytest.approx(LIFT_OFF_RATE, abs=1e-3)
    scene, model = Scene.grip(outputs="state"), default_model()
    for share, status in ((0.999, Status.OK), (1.001, Status.LIFT_OFF)):
        motion = [jnp.asarray(x) for x in (phase, direction * share * rate, 0.0, 0.0, 0.0)]
        needed = inverse(params, *motion)
        assert needed.normal_force / weight == pytest.approx(1 - share**2, abs=1e-6)
        state = state_of(phase=phase, crank_rate=direction * share * rate)
        after, contact = step(model, scene, state, needed.torque, jnp.asarray(1e-9))
        assert int(contact.status) == status
        assert (float(after.time) > 0) == (status == Status.OK)


def test_walking_backwards_retraces_the_walk_forwards(dtype):
    """A held foot has no friction work: turn the rate round and the walk runs back through its
    exchanges to where it began, kinetic energy and all."""
    counts, single = (50, 400, 800), dtype == jnp.float32
    go = [Start(mu_static=1e6, crank_rate=20.0, dt=1e-3, count=n) for n in counts]
    there = march(go, long_footed(dtype.name), dtype)
    assert there.state.steps.max() >= 2
    assert set(there.status) == {Status.OK}
    back = [
        Start(1e6, None, float(phase), -float(rate), dt=1e-3, count=n)
        for phase, rate, n in zip(there.state.phase, there.state.crank_rate, counts, strict=True)
    ]
    again = march(back, long_footed(dtype.name), dtype)
    assert set(again.status) == {Status.OK}
    turned = again.state.phase + np.pi * (again.state.steps + there.state.steps)
    np.testing.assert_allclose(turned, SUPPORT_START, atol=3e-4 if single else 2e-6)
    np.testing.assert_allclose(again.state.crank_rate, -20.0, atol=3e-3 if single else 2e-5)
