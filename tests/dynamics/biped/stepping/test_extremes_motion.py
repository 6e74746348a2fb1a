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
@pytest.mark.parametrize("integrator", UNSPLIT)
def test_unsplit_integrators_end_named_and_finite_too(integrator):
    assert_named_and_sound(marched("float32", integrator))


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


def kicks(direction: int) -> list[Start]:
    begin = SUPPORT_START if direction > 0 else SUPPORT_END
    rates = [6.0, 8.6, 9.0, 12.0, 20.0, 30.0, 50.0, 100.0, 1000.0]
    return [
        Start(mu_static=1.0, phase=begin, crank_rate=direction * rate, dt=5e-3, count=200)
        for rate in rates
    ]


@pytest.mark.parametrize("direction", [1, -1])
def test_kicked_cranks_walk_on_or_lift_off(dtype, direction):
    """Free crank, either way round. Past 8.6 rad/s it need not lift off, since it slows down where
    the body rises; from 50 rad/s it does, at 100 at once."""
    end = march(kicks(direction), long_footed(dtype.name), dtype)
    assert np.all(end.sound)
    words = [status.name for status in end.status]
    assert set(words[:5]) <= {"OK", "SLIP_ONSET"}
    assert words[-3:] == ["LIFT_OFF"] * 3
    assert np.all(end.state.time[-2:] == 0)
    assert np.all(np.diff(end.state.steps[2:5]) * direction > 0)


def test_torques_from_nothing_to_a_thousand_newton_metres(dtype):
    """From rest at pi/2: on the default foot a strong torque topples at once and moves nothing; on
    a long foot it spins the crank until the crank runs away, the foot lifts off, or the ZMP leaves
    the foot, a kilometre long, just before."""
    torques = [0.0, 0.1, 1.0, 2.0, 10.0, 100.0, 1000.0]
    signed = [*torques, *(-torque for torque in torques[1:])]
    rows = [Start(torque=torque, dt=5e-3, count=400) for torque in signed]
    short = march(rows, default_model(dtype=dtype.name), dtype)
    long = march(rows, long_footed(dtype.name), dtype)
    assert np.all(short.sound & long.sound)
    at_once = {name: np.array(signed)[end.state.time == 0] for name, end in
               (("short", short), ("long", long))}  # fmt: skip
    assert {2.0, 10.0, 100.0, 1000.0, -10.0, -100.0, -1000.0} <= set(at_once["short"])
    strong = np.abs(signed) >= 2
    left = {Status.TOPPLE, Status.LIFT_OFF, Status.NOT_CONVERGED}
    assert {short.status[i] for i in np.flatnonzero(strong)} <= left
    assert {long.status[i] for i in np.flatnonzero(strong)} <= left
    assert {Status.LIFT_OFF, Status.NOT_CONVERGED} & set(long.status)
    assert [short.status[i] for i in range(2)] == [long.status[i] for i in range(2)]


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


def test_time_steps_from_a_microsecond_to_a_tenth_of_a_second(dtype):
    """10 ms of a slipping walk: small steps cost digits in single precision only; a large one is
    finite, and its error is what it is."""
    sizes = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2]
    walk = {"mu_static": 0.06, "mu_kinetic": 0.05, "phase": 2.0, "crank_rate": 3.0, "torque": 0.9}
    rows = [Start(dt=size, count=round(1e-2 / size), **walk) for size in sizes]
    coarse = [Start(dt=size, count=round(0.5 / size), **walk) for size in (0.02, 0.05, 0.1)]
    end = march(rows + coarse, long_footed(dtype.name), dtype)
    assert np.all(end.sound)
    single = dtype == jnp.float32
    names = ("phase", "crank_rate", "foot_velocity")
    limits = (2e-4, 5e-4, 1e-4) if single else (1e-9, 1e-7, 1e-8)
    for name, limit in zip(names, limits, strict=True):
        values = getattr(end.state, name)[: len(sizes)]
        assert np.ptp(values[:4]) < limit, name
        assert np.ptp(values) < 1e-4, name
    assert all(status in (Status.OK, Status.SLIP_ONSET) for status in end.status[: len(sizes)])


NAMELESS = [
    {name: value}
    for name in ("phase", "crank_rate", "foot_velocity", "torque")
    for value in (np.nan, np.inf, -np.inf)
]


def test_a_number_that_is_none_is_named_and_takes_no_time(dtype):
    """Traced: outside a trace most of these are refused."""
    sound = {"mu_static": 0.1, "phase": 2.0, "crank_rate": 1.0}
    rows = [Start(**sound | bad) for bad in NAMELESS]
    end = march(rows, long_footed(dtype.name), dtype)
    assert set(end.status) == {Status.NON_FINITE}
    assert np.all(end.state.time == 0)
    given = [not {"phase", "crank_rate"} & bad.keys() for bad in NAMELESS]
    assert np.all(end.state.phase[given] == np.asarray(2.0, dtype))


def test_a_phase_outside_the_support_phase_is_no_place_to_start(dtype):
    """Traced, too: a leg does not carry there."""
    rows = [Start(1.0, None, phase, 1.0) for phase in (0.0, 1.5, 4.8, 100.0, -3.0, 1e30)]
    end = march(rows, long_footed(dtype.name), dtype)
    assert set(end.status) == {Status.NO_SOLUTION}
    np.testing.assert_array_equal(end.state.phase, np.array([r.phase for r in rows], dtype))
    assert np.all(end.state.time == 0)
