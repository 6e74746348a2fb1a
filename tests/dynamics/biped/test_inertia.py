"""M, P, Y: derivatives belong to their functions, the table to the exact functions."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.dynamics.biped import SUPPORT_END, SUPPORT_START, BipedParams, kinematics
from stickslip.dynamics.biped.model import load, loaded_params
from tests.dynamics.biped.helpers import (
    default_model,
    default_params,
    exact_along,
    inertia_along,
    model_of,
)

ANGLES = np.linspace(SUPPORT_START, SUPPORT_END, 2003)
PAIRS = (("M", "dM"), ("P", "dP"), ("Y", "dY"))


@jax.jit
def table_along(model, angles):
    return jax.vmap(model.inertia.at)(angles)


@jax.jit
def moments_along(model, angles):
    return jax.vmap(model.inertia.moment_at)(angles)


def off(got, want) -> float:
    """The largest difference."""
    return np.max(np.abs(np.asarray(got, float) - np.asarray(want, float)))


def worst(got, want) -> float:
    """The largest difference over the largest value."""
    return off(got, want) / np.max(np.abs(np.asarray(want, float)))


def random_robot(seed: int) -> BipedParams:
    """The default lengths with other masses, centres and inertias, link by link."""
    rng, params = np.random.default_rng(seed), default_params()
    return params.replace(
        mass=jnp.asarray(rng.uniform(0.05, 2.0, 13)),
        centre=params.centre + rng.normal(0, 0.02, (13, 2)),
        inertia=jnp.asarray(rng.uniform(0.0, 5e-3, 13)),
        payload=jnp.asarray(rng.uniform(0.0, 5.0)),
    )


@jax.jit
def sums_over_bodies(params, angles):
    """sum m X, sum m y and the payload's share, from positions alone."""

    def at(angle):
        now = kinematics(params, angle)
        order = np.array([*range(13), *(i for i in range(12) if i != 7)])
        mass = params.mass.at[12].add(params.payload)[order]
        return mass @ now.centres

    return jax.vmap(at)(angles)


@pytest.mark.parametrize("seed", range(3))
def test_P_and_Y_are_the_slopes_of_the_mass_moments(float64, seed):
    params, angles, h = random_robot(seed), jnp.linspace(1.6, 4.7, 50), 3e-4
    ahead, behind = (np.asarray(sums_over_bodies(params, angles + s)) for s in (h, -h))
    far, back = (np.asarray(sums_over_bodies(params, angles + 2 * s)) for s in (h, -h))
    slope = (8 * (ahead - behind) - (far - back)) / (12 * h)
    inertia = inertia_along(params, angles)
    assert worst(inertia.P, slope[:, 0]) < 1e-9
    assert worst(inertia.Y, slope[:, 1]) < 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_slopes_are_the_derivatives_of_their_functions(float64, seed):
    params, angles, h = random_robot(seed), jnp.linspace(1.6, 4.7, 50), 3e-4
    now = inertia_along(params, angles)
    at = {s: inertia_along(params, angles + s * h) for s in (-2, -1, 1, 2)}
    for value, slope in PAIRS:
        near = getattr(at[1], value) - getattr(at[-1], value)
        far = getattr(at[2], value) - getattr(at[-2], value)
        assert worst(getattr(now, slope), (8 * near - far) / (12 * h)) < 1e-9, slope


def test_the_default_table_gives_1e_10_on_values_and_1e_8_on_slopes(float64):
    """In SI units, rounded to one digit: measured 1.7e-10 and 1.3e-8 (moments less)."""
    model, angles = default_model("table"), jnp.asarray(ANGLES)
    exact, table = inertia_along(default_params(), angles), table_along(model, angles)
    for value, slope in PAIRS:
        assert off(getattr(table, value), getattr(exact, value)) < 2e-10, value
        assert off(getattr(table, slope), getattr(exact, slope)) < 2e-8, slope
    exact, table = exact_along(default_params(), angles)[1], moments_along(model, angles)
    for name, bound in (("L", 2e-10), ("dL", 2e-8), ("X", 2e-11), ("Y", 2e-11)):
        assert off(getattr(table, name), getattr(exact, name)) < bound, name


def test_float32_table_keeps_its_digits(float64):
    """Rounding errors, summed over 24 bodies: 4e-6 of the largest, as the exact functions."""
    table = table_along(default_model("table", "float32"), jnp.asarray(ANGLES, jnp.float32))
    exact = inertia_along(default_params(), ANGLES.astype(np.float32))
    for value, slope in PAIRS:
        assert getattr(table, value).dtype == jnp.float32
        assert worst(getattr(table, value), getattr(exact, value)) < 5e-6, value
        assert worst(getattr(table, slope), getattr(exact, slope)) < 5e-6, slope


def test_a_series_goes_on_straight_behind_the_support_phase(float64):
    """Where trial steps end: at 14 rad/s 0.28 rad behind it; Y is 43 % off a straight line then."""
    inertia = model_of(default_params(), "chebyshev").inertia
    angles = jnp.asarray([SUPPORT_START - 0.28, SUPPORT_START, SUPPORT_END, SUPPORT_END + 0.28])
    series, exact = jax.vmap(inertia.at)(angles), exact_along(default_params(), angles)[0]
    for value, slope in PAIRS:
        assert worst(getattr(series, value), getattr(exact, value)) < 0.5, value
        behind, end = getattr(series, slope)[::3], getattr(series, slope)[1:3]
        assert worst(behind, end) < 0.05, slope
    moments = jax.vmap(inertia.moment_at)(angles)
    for name in moments._fields:
        assert worst(getattr(moments, name)[::3], getattr(moments, name)[1:3]) < 0.05, name


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), angle=st.floats(SUPPORT_START, SUPPORT_END))
def test_inertia_is_positive_definite_and_bounds_its_coupling(float64, seed, angle):
    """M > 0, and M m > P^2: the kinetic energy is positive whatever crank and foot do."""
    params = random_robot(seed)
    M, _, P, *_ = inertia_along(params, [angle])
    assert float(M[0]) > 0
    assert float(M[0] * params.total_mass) > float(P[0] ** 2)


def test_a_loaded_robot_has_the_masses_of_its_inertia_functions(float64):
    """Loaded on a payload of its own."""
    own = default_params().replace(payload=jnp.asarray(0.5))
    model, unit = model_of(own), default_model().unit_inertia()
    model = load(model, unit, 1.3, 2.0)
    params = loaded_params(model)
    assert float(params.payload) == pytest.approx(1.3 * 0.5 + 2.0)
    assert float(params.total_mass) == pytest.approx(float(model.total_mass), rel=1e-14)
    inertia, moment = exact_along(params, ANGLES[::50])
    angles = jnp.asarray(ANGLES[::50])
    for found, want in ((table_along, inertia), (moments_along, moment)):
        for a, b in zip(found(model, angles), want, strict=True):
            assert worst(a, b) < 1e-10
