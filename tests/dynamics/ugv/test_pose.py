"""Where the vehicle stands: the pose's geometry and hollow ground."""

from dataclasses import replace
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.pytrees import rebuilt
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, Track, UGVParams, place
from stickslip.dynamics.ugv.poses import clearance
from tests.dynamics.ugv.helpers import SCAN, TRACKS, balanced, drawn, placed


@pytest.mark.parametrize(
    "name",
    ["slope", "ditch", *(pytest.param(n, marks=pytest.mark.long) for n in ("flat", "sinusoid"))],
)
def test_wheels_touch_and_the_links_have_their_lengths(float64, name):
    params, track = UGVParams(), TRACKS[name]().astype(float64)
    x, angles = drawn(params, float64)
    got = placed(params, track, x, angles)
    assert np.all(np.asarray(got.status) == Status.OK)

    def length(a, b):
        return np.hypot(*np.moveaxis(np.asarray(a - b), -1, 0))

    close = {"rtol": 0, "atol": 1e-12}
    np.testing.assert_allclose(length(got.rear.centre, got.rear.point), 0.28, **close)
    np.testing.assert_allclose(length(got.rear.centre, got.front.centre), got.wheelbase, **close)
    np.testing.assert_allclose(length(got.rear_hinge, got.rear.centre), 0.35, **close)
    np.testing.assert_allclose(length(got.front_hinge, got.front.centre), 0.35, **close)
    np.testing.assert_allclose(length(got.rear_hinge, got.front_hinge), 0.83, **close)
    np.testing.assert_allclose(got.rear.point[:, 1], track.height(got.rear.x), **close)
    # In the body's frame all of the rear leg lies behind all of the front one: they never cross.
    behind = 0.35 * np.cos(np.minimum(angles, np.pi / 2)).sum(-1)
    assert np.all((behind < 0.83) & (np.asarray(got.rear.x) < np.asarray(got.front.x)))
    wheels = 0.83 - 0.35 * np.cos(angles).sum(-1), 0.35 * np.diff(np.sin(angles))[:, 0]
    np.testing.assert_allclose(got.wheel_clearance, np.hypot(*wheels) - 0.56, **close)
    body = np.asarray(got.front_hinge - got.rear_hinge)
    np.testing.assert_allclose(np.arctan2(body[:, 1], body[:, 0]), got.pitch, **close)
    for hinge, wheel, axis, leg in (
        (got.rear_hinge, got.rear, body, 0),
        (got.front_hinge, got.front, -body, 1),
    ):
        cos = np.sum(np.asarray((wheel.centre - hinge) * axis), -1) / (0.35 * 0.83)
        np.testing.assert_allclose(np.arccos(cos), angles[:, leg], rtol=1e-12)


def envelope_centre(track, params, got):
    """The rear centre from the definition: the lowest centres that no ground enters.

    Heights on a fine grid, the highest centre above each place by brute force, and the nearest
    crossing of the circle about the front centre; good to the grid.
    """
    r, R = params.wheel_radius, float(got.wheelbase)
    s_front, g_front = (float(v) for v in got.front.centre)
    s = np.linspace(s_front - 1.01 * R, s_front, 1001)
    across = np.linspace(-r, r, 601)
    ground = np.asarray(track.height(jnp.asarray(s[:, None] + across)))
    above = ground + np.sqrt(r**2 - across**2)
    centre = above.max(1)
    outside = np.hypot(s - s_front, centre - g_front) >= R
    at = np.nonzero(outside)[0].max()
    return s[at], centre[at]


HARD = {
    "sharp step": lambda: Track.step(0.15, 4.0, 0.1),
    "ditch": lambda: Track.ditch(0.2, 4.0, 0.5, 0.1),
    "spike": lambda: Track.bump(0.3, 4.0, 0.15),
    "washboard": lambda: Track.sinusoid(0.1, 0.6),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * (name != "ditch")) for name in HARD]
)
def test_hollow_ground_is_passed_as_the_wheel_passes_it_or_told(float64, name):
    """Against the definition by brute force: nearly everywhere placed, never wrong."""
    params, track = UGVParams(), HARD[name]().astype(float64)
    x, angles = drawn(params, float64, 400, 3.0, 6.0)
    simple, scanned = placed(params, track, x, angles), placed(params, track, x, angles, SCAN)
    told = set(np.unique(simple.status)) | set(np.unique(scanned.status))
    assert told <= {Status.OK, Status.HOLLOW_GROUND}
    assert np.any(np.asarray(simple.status) == Status.HOLLOW_GROUND)
    fine = np.asarray(simple.status) == Status.OK
    assert np.all(np.asarray(scanned.status)[fine] == Status.OK)
    np.testing.assert_allclose(scanned.rear.x[fine], simple.rear.x[fine], atol=1e-9)
    for i in np.nonzero(np.asarray(scanned.status) == Status.OK)[0][:25]:
        one = jax.tree.map(lambda leaf, i=i: leaf[i], scanned)
        # The grid's step is 1.6 mm at most, on slopes up to 4.
        centre = envelope_centre(track, params, one)
        np.testing.assert_allclose(one.rear.centre, centre, atol=0.01)


def test_the_scan_refuses_only_where_the_front_wheel_itself_cannot_touch(float64):
    """The front contact is given: where no wheel can touch, no pose exists."""
    params, track = UGVParams(), HARD["ditch"]().astype(float64)
    x, angles = drawn(params, float64, 400, 3.0, 6.0)
    scanned = placed(params, track, x, angles, SCAN)
    refused = np.asarray(scanned.status) == Status.HOLLOW_GROUND
    assert refused.any()
    r = params.wheel_radius
    across = np.linspace(-r, r, 4001)
    centres = np.asarray(scanned.front.centre)[refused]
    ground = np.asarray(track.height(jnp.asarray(centres[:, :1] + across)))
    entered = (ground + np.sqrt(r**2 - across**2)).max(1) - centres[:, 1]
    assert entered.min() > 1e-9


@pytest.mark.long
def test_a_leg_stretched_or_folded_until_the_wheelbase_vanishes(float64):
    """With legs as long as half the body, flat inwards, the wheels meet at one point."""
    fields = {"body_length": 0.7, "leg_length": 0.35, "leg_angle_min": 0.0}
    params = rebuilt(UGVParams(), **fields)  # the constructor refuses it
    folded = jnp.asarray([[0.0, 0.0], [1e-9, 1e-9], [1e-3, 1e-3], [np.pi, np.pi]])
    state = balanced(params, Track.bump().astype(float64), jnp.full(4, 4.0), folded)
    assert np.all(state.status[:2] == Status.NO_SOLUTION)  # cos(1e-9) is 1 to the last digit
    for leaf in jax.tree.leaves((state.forces, state.torque, state.leg_torques)):
        assert np.all(np.isfinite(leaf[2:]))
    assert state.pose.status[3] == Status.OK
    np.testing.assert_allclose(state.pose.wheelbase[3], 1.4, rtol=1e-14)


@pytest.mark.long
def test_bad_members_of_a_batch_leave_the_others_alone(float64):
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 8)
    bad = x.at[3].set(jnp.nan).at[5].set(jnp.inf)
    state, alone = balanced(params, track, bad, angles), balanced(params, track, x, angles)
    assert [int(s) for s in state.status[jnp.array([3, 5])]] == [Status.NON_FINITE] * 2
    others = np.array([0, 1, 2, 4, 6, 7])
    np.testing.assert_array_equal(state.torque[others], alone.torque[others])


@pytest.mark.long
def test_without_jit_a_place_is_what_it_is_with_it(float64):
    """Loops count in Python's integers then; `jax.disable_jit` is how a user looks into a step."""
    params, track = UGVParams(), HARD["ditch"]().astype(float64)
    x, angles = drawn(params, float64, 3, 3.0, 6.0)
    found = placed(params, track, x, angles)
    with jax.disable_jit(), jax.numpy_dtype_promotion("standard"):
        written = place(params, track, x, angles, PoseSolver())
        heights = clearance(params, track, written, 8)
    np.testing.assert_array_equal(written.status, found.status)
    np.testing.assert_allclose(written.pitch, found.pitch, rtol=1e-12)
    np.testing.assert_allclose(heights, clearance(params, track, found, 8), rtol=1e-12)


def test_the_clearance_is_that_of_the_body_and_of_what_the_wheels_leave_of_upright_legs(float64):
    """By hand, and so its slope: the lowest of 8 points is a sixteenth above the leg's end."""
    params = UGVParams()
    radius, leg = params.wheel_radius, params.leg_length

    def standing(at):
        hinge, centre = jnp.array([at, radius + leg]), jnp.array([at, radius])
        return hinge, SimpleNamespace(centre=centre)

    (rear_hinge, rear), (front_hinge, front) = standing(1.0), standing(1.83)
    placed = SimpleNamespace(
        rear_hinge=rear_hinge, rear=rear, front_hinge=front_hinge, front=front, wheelbase=0.83
    )

    def found(radius):
        larger = replace(params, wheel_radius=radius)
        return clearance(larger, Track.flat().astype(float64), placed, 8)

    bare = leg - radius
    r, clear = params.wheel_radius, radius + leg - 15 / 16 * bare
    np.testing.assert_allclose(found(r), clear, rtol=1e-12)
    np.testing.assert_allclose(jax.grad(found)(r), 15 / 16, rtol=1e-12)
    np.testing.assert_allclose(found(2 * leg), radius + leg, rtol=1e-12)  # wheels hide the legs
