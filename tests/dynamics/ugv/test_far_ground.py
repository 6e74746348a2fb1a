"""A vehicle stands the same wherever the ground lies, and as a slow calculation says."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import Odometer, PoseSolver, Track, UGVParams, equilibrium, pose
from stickslip.dynamics.ugv.poses import stand, wheel_lags
from stickslip.dynamics.ugv.statics import balance
from tests.dynamics.ugv.slow import Slow
from tests.precision import mostly_single

AWAY, UP = 1024.0, 1500.0
PARAMS = UGVParams()


def points(count=97, step=0.125, seed=3):
    """Heights that single precision holds at 0 and double precision at 1500 m without rounding."""
    x = step * np.arange(count)
    phases = np.random.default_rng(seed).uniform(0, 6, 3)
    y = sum(0.05 / k**2 * np.sin(k * x + phase) for k, phase in zip((1, 2, 5), phases, strict=True))
    return x, np.round(y * 2**18) / 2**18


def uneven(x):
    return x + np.where(np.arange(len(x)) % 3 == 1, 0.015625, 0.0)


def shifted(kind, by, up):
    x, y = points()
    if kind == "uneven":
        return Track.from_points(uneven(x) + by, y + up)
    if kind in ("bump", "ramp", "step", "ditch"):
        place = {"centre" if kind == "bump" else "position": 6.0 + by}
        return Track.named(kind, **place, start=by, end=12.0 + by)
    track = Track.from_points(x + by, y + up, kind.removesuffix(" table"))
    return track.resampled(by, by + 12.0, 96) if kind.endswith("table") else track


@jax.jit
def differences(params, track, odometer, x, angles):
    """What must not depend on where the ground lies."""
    placed = stand(params, track, x, angles, PoseSolver())
    held = balance(params, placed, 0.8)
    climbed = track.seen_from(x[0]).height(x - x[0])
    rise = jnp.diff(placed.energy_above_origin(params) + params.weight * climbed)
    turn = jnp.diff(wheel_lags(params, odometer, placed, angles), axis=0)
    numbers = (*held.forces, held.torque, held.leg_torques, held.clearance, placed.pitch)
    return (*numbers, placed.rear.x, placed.rear.centre, rise, turn), held.status


OTHERS = ("uneven", "pchip", "linear", "cubic table", "ramp", "step", "ditch")
"""Kinds of ground that share their code with cubic and bump."""


@pytest.mark.parametrize(
    "kind", ["cubic", "bump", *(pytest.param(one, marks=pytest.mark.long) for one in OTHERS)]
)
@mostly_single
def test_nothing_depends_on_where_the_ground_lies(kind, dtype):
    """Moved by 1 km and 1500 m: the same to 1e-12, in float32 to a few of its roundings."""
    x = jnp.asarray(2.0 + 0.125 * np.arange(64), dtype)
    angles = jnp.asarray(np.random.default_rng(0).uniform(0.9, 2.2, (64, 2)), dtype)
    here, there = (shifted(kind, *by) for by in ((0.0, 0.0), (AWAY, UP)))
    both = (here, x), (there, x + AWAY)
    found = [differences(PARAMS, track, Odometer.along(track), at, angles) for track, at in both]
    np.testing.assert_array_equal(found[0][1], found[1][1])
    assert np.mean(np.asarray(found[0][1]) == Status.OK) > (0.1 if kind == "linear" else 0.5)
    for one, other in zip(found[0][0], found[1][0], strict=True):
        assert one.dtype == dtype
        eps = max(16 * float(jnp.finfo(dtype).eps), 1e-12)
        np.testing.assert_allclose(other, one, rtol=eps, atol=eps * np.max(np.abs(one)))


@pytest.mark.parametrize("wide", [pytest.param(False, marks=pytest.mark.long), True])
def test_poses_and_forces_are_those_of_a_slow_calculation(wide):
    """At 619 m and 1500 m, on 10,001 points 0.1 m apart: in either precision, to its rounding."""
    x = 0.1 * np.arange(10_001)
    y = UP + 30 * np.sin(x / 50) + 0.02 * np.sin(2 * x) + 0.01 * np.sin(5 * x + 1)
    near = slice(6130, 6290)
    slow = Slow(x[near], y[near], (x[6190], y[6190]))
    random = np.random.default_rng(1)
    places = x[6190] + np.round(random.uniform(0, 6, 12) * 8) / 8
    angles = random.uniform(0.9, 2.2, (12, 2))
    track = Track.from_points(x, y)
    with jax.enable_x64(wide):
        if not wide:
            places = places.astype(np.float32).astype(float)
        given = jnp.asarray(places), jnp.asarray(angles)
        held = equilibrium(PARAMS, track, *given)
        odometer = Odometer.along(track)
        turns = np.asarray(differences(PARAMS, track, odometer, *given)[0][-1])
        angles = np.asarray(given[1], float)
    truth = [slow.held(at - x[6190], pair) for at, pair in zip(places, angles, strict=True)]
    error = {"rtol": 1e-11 if wide else 2e-4, "atol": 1e-9 if wide else 5e-2}
    np.testing.assert_allclose(held.torque, [of["torque"] for of in truth], **error)
    normal = np.stack([held.N_rear, held.N_front], -1)
    np.testing.assert_allclose(normal, [of["N"] for of in truth], **error)
    level = np.diff(places) * 2 / PARAMS.wheel_radius
    exact = np.diff([of["turn"] for of in truth]) + level
    np.testing.assert_allclose(np.sum(turns, -1), exact, atol=1e-10 if wide else 1e-4)


def test_points_too_near_for_single_precision_are_refused_where_it_is_used():
    x = np.array([1000.0, 1000.00001, 1001.0, 1004.0])
    track = Track.from_points(x, np.zeros(4))
    with pytest.raises(ValueError, match=r"x\[1\] = 1000.00001 .* one number in float32"):
        pose(PARAMS, track, 1003.0, np.array([1.5, 1.5]))
    with pytest.raises(ValueError, match="one number in float32"):
        track.astype(jnp.float32)
    with jax.enable_x64(True):
        placed = pose(PARAMS, track, 1003.0, np.array([1.5, 1.5]))
    assert placed.status == Status.OK


def test_a_short_cell_ends_at_every_knot_of_a_long_track(float64):
    """The way over 1 km of kinked ground is that of its chords."""
    x = 0.5 * np.arange(2001)
    y = np.random.default_rng(0).normal(0, 0.05, 2001)
    for places in (x, np.sort(np.random.default_rng(1).uniform(0, 1000, 2001))):
        odometer = Odometer.along(Track.from_points(places, y, "linear"))
        exact = np.append(0.0, np.cumsum(np.hypot(np.diff(places), np.diff(y))))
        found = jax.jit(odometer.distance)(jnp.asarray(places))
        np.testing.assert_allclose(found, exact, rtol=1e-13)
        part = replace(odometer, start=places[3])
        assert part.start == places[3]
