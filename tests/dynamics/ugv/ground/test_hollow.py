"""What is proved of ground that no wheel enters, and that nothing else depends on the proof."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, place, poses
from stickslip.dynamics.ugv.ground.roughness import Waves
from stickslip.dynamics.ugv.ground.shapes import (
    Bump,
    Ditch,
    Flat,
    Function,
    Incline,
    Ramp,
    Sinusoid,
    Step,
    nowhere_hollow,
)
from stickslip.dynamics.ugv.ground.spline import Spline, spline_through
from tests.dynamics.ugv.helpers import drawn

COUNT = 50
RADIUS = float(UGVParams().wheel_radius)


def shapes():
    """Closed forms with numbers [COUNT, 1], and how much the bound may exceed what is found."""
    random = np.random.default_rng(3)

    def some(low, high):
        return random.uniform(low, high, (COUNT, 1))

    return [
        (Flat(), 1.0),
        (Incline(some(-1, 1)), 1.0),
        (Bump(some(-0.3, 0.3), some(-1, 1), some(0.3, 2)), 1.01),
        (Sinusoid(some(-0.3, 0.3), some(0.5, 3)), 1.01),
        (Ramp(some(-1, 1), some(-1, 1), some(1.5, 3), some(0.3, 1.4)), 1.01),
        (Ramp(some(-1, 1), some(-1, 1), some(0.3, 1), some(1.0, 2)), np.inf),
        (Step(some(-0.3, 0.3), some(-1, 1), some(0.3, 2)), 1.01),
        (Ditch(some(-0.3, 0.3), some(-1, 1), some(1, 2), some(0.3, 1)), 1.01),
        (Ditch(some(-0.3, 0.3), some(-1, 1), some(0.2, 1), some(1, 2)), np.inf),
        (Waves(*(random.uniform(0, high, 8) for high in (0.05, 1.0, 6.0))), 10.0),
    ]


def test_no_second_derivative_exceeds_the_bound_of_a_closed_form(float64):
    x = np.linspace(-4, 7, 4001)
    for shape, times in shapes():
        found = np.max(np.asarray(shape.profile(x)[2]).reshape(-1, x.size), axis=1)
        bound = np.ravel(np.asarray(shape.greatest_bend(RADIUS)))
        assert np.all(found <= bound * (1 + 1e-9) + 1e-12), shape
        assert np.all(bound <= times * found + 1e-12), shape


def splines():
    """Three splines through points, and three tables; each kind of one structure."""
    random = np.random.default_rng(5)
    x = np.cumsum(random.uniform(0.2, 0.6, 30))
    y = 0.02 * np.cumsum(random.normal(size=30))
    fitted = [spline_through(x, y, kind) for kind in ("cubic", "pchip", "makima")]
    tables = [Track.bump(), Track.step(), Track.rough(iso_class="E")]
    return fitted, [track.resampled(0.0, 9.0, 60).shape for track in tables]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_nor_that_of_a_spline_in_either_precision(dtype):
    @jax.jit
    @jax.vmap
    def both(shape):
        x = jnp.linspace(-1, 11, 20001, dtype=dtype)
        radius = np.asarray(RADIUS, dtype)
        return shape.greatest_bend(radius), jnp.max(shape.profile(x)[2])

    for alike in splines():
        with jax.enable_x64(dtype == "float64"):
            stacked = jax.tree.map(lambda *of: jnp.asarray(np.stack(of), dtype), *alike)
            bound, found = map(np.asarray, both(stacked))
        assert np.all(found <= bound * (1 + 1e-5) + 1e-6)
        assert np.all(bound < 1.2 * found)


def test_a_spline_with_kinks_jumps_or_too_many_pieces_is_not_proved():
    assert nowhere_hollow(spline_through(np.arange(4.0), 0.1 * np.arange(4.0), "linear"), RADIUS)
    bent = spline_through(np.arange(3.0), np.array([0.0, 0.0, 1e-2]), "linear")
    assert not nowhere_hollow(bent, RADIUS)
    cubic = spline_through(np.arange(5.0), 0.01 * np.arange(5.0) ** 2)
    assert nowhere_hollow(cubic, RADIUS)
    for where, by in (((2, 0), 1e-3), ((2, 1), 1e-2)):
        rows = np.array(cubic.coefficients)
        rows[where] += by
        assert not nowhere_hollow(replace(cubic, coefficients=rows), RADIUS)
    numbers = np.full((2, 6), np.nan)
    assert not nowhere_hollow(Spline.of(np.arange(3.0), numbers, even=True), RADIUS)
    many = Spline.of(np.arange(5001.0), np.zeros((5000, 2)), even=True)
    assert nowhere_hollow(many, RADIUS) is None
    assert nowhere_hollow(Function(jnp.sin), RADIUS) is None


def test_where_it_is_proved_nothing_is_looked_up_and_the_status_is_the_same(monkeypatch):
    """Feet of bumps from gentle to far hollower than the wheel, each with poses along it."""
    params, count = UGVParams(), 24
    widths = jnp.geomspace(0.1, 1.0, 40, dtype=jnp.float32)
    x, angles = drawn(params, "float32", count, low=3.0, high=7.0)

    def statuses(width):
        track, solver = Track.bump(0.25, 5.0, width), PoseSolver(iterations=6)
        return place(params, track, x, angles, solver).status

    proved = jax.vmap(lambda w: nowhere_hollow(Bump(0.25, 5.0, w), RADIUS))(widths)
    assert 10 < int(jnp.sum(proved)) < 30
    found = jax.jit(jax.vmap(statuses))(widths)
    monkeypatch.setattr(poses, "nowhere_hollow", lambda shape, radius: None)
    looked_up = jax.jit(jax.vmap(lambda width: statuses(width)))(widths)
    np.testing.assert_array_equal(found, looked_up)
    hollow = np.asarray(looked_up) == Status.HOLLOW_GROUND
    assert hollow[~np.asarray(proved)].any()
    assert not hollow[np.asarray(proved)].any()
