"""Friction that changes along the ground counts under each wheel by itself."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.dynamics.ugv import Surface, Track, UGVParams, equilibrium

ANGLES = np.radians([110.0, 95.0])


def test_patches_are_constant_with_short_ramps_between_them():
    surface = Surface.patches([1.0, 2.0], [0.2, 1.0, 0.4], ramp=0.1)
    x = np.array([-5.0, 0.94, 1.0, 1.06, 1.94, 2.025, 9.0])
    np.testing.assert_allclose(surface.at(x), [0.2, 0.2, 0.6, 1.0, 1.0, 0.55, 0.4], atol=1e-6)


def test_the_most_on_a_stretch_is_what_no_place_of_it_exceeds():
    surface = Surface.patches([1.0, 2.0, 2.6], [0.2, 1.0, 0.4, 0.7])
    random = np.random.default_rng(0)
    first = random.uniform(0, 3, 200)
    last = first + random.uniform(0, 1, 200)
    most = surface.most(first, last)
    seen = np.interp(np.linspace(first, last, 801), surface.knots, surface.factors).max(0)
    assert np.all(seen <= most + 1e-12)
    assert np.all(most - seen < 0.03)


def test_each_wheel_has_the_friction_of_its_own_contact():
    uniform = Track.bump(0.1)
    x = np.array([3.2, 3.6, 4.0, 4.4])
    even = equilibrium(UGVParams(), uniform, x, ANGLES, 0.8)
    rear = np.asarray(even.pose.rear.point[..., 0])
    edge = float((rear[1] + x[1]) / 2)
    patchy = replace(uniform, surface=Surface.patches([edge], [0.25, 1.0]))
    held = equilibrium(UGVParams(), patchy, x, ANGLES, 0.8)
    for got, wanted in zip(held.pose.rear.point[..., 0], rear, strict=True):
        assert float(got) == pytest.approx(float(wanted), rel=1e-6)
    factors = [np.where(at > edge, 1.0, 0.25) for at in (rear, x)]
    for name, factor in zip(("rear", "front"), factors, strict=True):
        N, F = (np.asarray(getattr(held, f"{of}_{name}")) for of in "NF")
        grip = np.asarray(getattr(held, f"grip_{name}"))
        np.testing.assert_allclose(grip, 0.8 * factor * N - np.abs(F), rtol=1e-5, atol=1e-2)
    assert factors[0][1] != factors[1][1]
    np.testing.assert_array_equal(held.torque, even.torque)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (
            lambda: Surface.patches([1.0, 1.02], [1, 1, 1]),
            "ascending edges further apart than one ramp",
        ),
        (lambda: Surface.patches([1.0], [1, -1]), "factors"),
        (lambda: Surface.patches([1.0], [1, 1], ramp=0.0), "ramp"),
        (lambda: Surface([0.0, 0.0], [1, 1]).validate(), "knots"),
        (lambda: Surface([0.0, 1.0], [1, float("nan")]).validate(), "factors"),
    ],
)
def test_what_is_no_surface_is_named(make, named):
    with pytest.raises(ValueError, match=named):
        make()
