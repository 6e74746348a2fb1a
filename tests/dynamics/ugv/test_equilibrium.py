"""Equilibrium: the chapter's equations, virtual work, and the physics that needs no program."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import linprog

from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import (
    Odometer,
    PoseSolver,
    Track,
    UGVParams,
    balance,
    equilibrium,
    ground_forces,
    leg_torques,
    place,
    safe_split,
    wheel_turns,
)
from tests.dynamics.ugv.helpers import TRACKS, balanced, chapter, drawn, mirrored, placed


@pytest.mark.parametrize("name", ["ditch", pytest.param("bump", marks=pytest.mark.long)])
def test_the_closed_form_solves_the_chapters_equations_for_random_vehicles(float64, name):
    random = np.random.default_rng(3)
    track, default = TRACKS[name]().astype(float64), UGVParams()
    factors = jnp.asarray(random.uniform(0.5, 2.0, (6, 32)))
    names = ("body_length", "wheel_radius", "wheel_mass", "body_mass", "leg_mass", "gravity")
    fields = {of: getattr(default, of) * by for of, by in zip(names, factors, strict=True)}
    fields["leg_length"] = fields["body_length"] * jnp.asarray(random.uniform(0.2, 0.5, 32))
    vehicles = jax.tree.map(lambda v: jnp.broadcast_to(v, 32), UGVParams(**fields))
    x, angles = drawn(default, float64, 32, 3.5, 6.0)
    placed = jax.jit(jax.vmap(lambda p, x, a: place(p, track, x, a, PoseSolver())))
    pose = placed(vehicles, x, angles)
    good = np.asarray(pose.status == Status.OK)
    assert good.sum() > 20
    forces = jax.vmap(ground_forces)(vehicles, pose)
    rows, right = jax.vmap(chapter)(vehicles, pose)
    solution = jnp.linalg.solve(rows, right[..., None])[..., 0]
    ours = jnp.stack([*forces, -forces.F_rear * vehicles.wheel_radius], -1)
    off = np.abs(ours - solution[:, jnp.array([0, 1, 2, 3, 8])])
    assert np.max(off[good] / np.asarray(vehicles.weight)[good, None]) < 1e-10


@pytest.mark.parametrize("resistance", [0.0, 0.03, 0.4])
def test_rolling_resistance_enters_the_nine_equations_as_moments_of_the_normal_forces(
    float64, resistance
):
    params, track = UGVParams(rolling_resistance=resistance), TRACKS["bump"]().astype(float64)
    x, angles = drawn(params, float64, 32)
    state = balanced(params, track, x, angles)
    rows, right = map(np.asarray, chapter(params, state.pose))
    solved = [np.linalg.lstsq(A, b)[0] for A, b in zip(rows, right, strict=True)]
    ours = np.stack([*state.forces, state.torque], -1)
    exact = np.array(solved)[:, [0, 1, 2, 3, 8]]
    np.testing.assert_allclose(ours, exact, atol=1e-10 * params.weight)
    if resistance == 0.0:
        for one, other in zip(state[:8], balanced(UGVParams(), track, x, angles)[:8], strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11 * params.weight)


@pytest.mark.parametrize("name", ["bump", pytest.param("sinusoid", marks=pytest.mark.long)])
@pytest.mark.parametrize(("difference", "resistance"), [(0.0, None), (300.0, None), (300.0, 0.2)])
def test_work_of_motors_and_legs_is_the_change_of_potential_energy(
    float64, name, difference, resistance
):
    """Virtual work along the track and by each leg, also with unequal torques at the wheels; and
    what rolling resistance takes, its moment times the wheels' turn in the world."""
    params = UGVParams(rolling_resistance=resistance)
    track = TRACKS[name]().astype(float64)
    odometer = Odometer.along(track, 0.0, 8.0)
    x, angles = drawn(params, float64, 16)

    def energy_and_turns(x, angles):
        pose = place(params, track, x, angles, PoseSolver())
        turns = wheel_turns(params, odometer, pose, angles)
        in_world = turns + pose.pitch + angles * jnp.array([-1.0, 1.0])
        return pose.potential_energy(params), turns, in_world

    slopes = jax.jit(jax.vmap(jax.jacfwd(energy_and_turns, argnums=(0, 1))))(x, angles)
    (V_x, V_a), (turns_x, turns_a), (world_x, world_a) = slopes
    pose = placed(params, track, x, angles)
    forces = ground_forces(params, pose, difference)
    N = jnp.stack([forces.N_rear, forces.N_front], -1)
    against = (resistance or 0.0) * params.wheel_radius * N
    M = -params.wheel_radius * jnp.stack([forces.F_rear, forces.F_front], -1) - against
    np.testing.assert_allclose(M[:, 0] - M[:, 1], params.wheel_radius * difference, atol=1e-8)
    close = {"atol": 1e-10 * params.weight}
    np.testing.assert_allclose(jnp.sum(M * turns_x + against * world_x, -1), V_x, **close)
    work = jnp.einsum("nw,nwa->na", M, turns_a) + leg_torques(params, pose, forces)
    work += jnp.einsum("nw,nwa->na", against, world_a)
    np.testing.assert_allclose(work, V_a, **close)


@pytest.mark.parametrize("slope", [-0.5, 0.3, np.tan(np.radians(89))])
def test_a_slope_takes_its_share_of_the_weight(float64, slope):
    params = UGVParams()
    x, angles = drawn(params, float64)
    state = balanced(params, Track.incline(slope).astype(float64), x, angles)
    share = params.weight * np.sin(np.arctan(slope)) / 2
    np.testing.assert_allclose(state.F_rear, share, rtol=1e-12)
    np.testing.assert_allclose(state.F_front, share, rtol=1e-12)


def test_backwards_over_the_mirrored_track_the_forces_change_places(float64):
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 16, 2.5, 6.5)
    state = balanced(params, track, x, angles)
    other = mirrored(track, 4.0)
    there = balanced(params, other, 8.0 - state.pose.rear.x, angles[:, ::-1])
    tight = {"rtol": 1e-9, "atol": 1e-9 * params.weight}
    np.testing.assert_allclose(8.0 - there.pose.rear.x, x, rtol=1e-12)
    np.testing.assert_allclose(there.pose.pitch, -state.pose.pitch, atol=1e-12)
    np.testing.assert_allclose(there.N_rear, state.N_front, **tight)
    np.testing.assert_allclose(there.F_front, -state.F_rear, **tight)
    np.testing.assert_allclose(there.torque, -state.torque, **tight)
    np.testing.assert_allclose(there.leg_torques[:, ::-1], state.leg_torques, **tight)


def test_scale_invariance_of_length_mass_and_gravity(float64):
    params = UGVParams()
    x, angles = drawn(params, float64, 16)
    base = balanced(params, Track.bump().astype(float64), x, angles)
    for length, mass, gravity in ((1e3, 1.0, 1.0), (1e-3, 1e6, 1.0), (1.0, 1e-6, 25.0)):
        scaled = UGVParams(
            *(length * v for v in (params.body_length, params.leg_length, params.wheel_radius)),
            *(mass * v for v in (params.wheel_mass, params.body_mass, params.leg_mass)),
            gravity=gravity * params.gravity,
        )
        track = Track.bump(0.1 * length, 4.0 * length, length, end=8.0 * length).astype(float64)
        state = balanced(scaled, track, x * length, angles)
        force = mass * gravity
        for key in ("F_rear", "N_rear", "N_front", "grip_rear"):
            ours, theirs = getattr(state, key) / force, getattr(base, key)
            np.testing.assert_allclose(ours, theirs, atol=1e-10 * params.weight, err_msg=key)
        np.testing.assert_allclose(
            state.leg_torques / (force * length), base.leg_torques, atol=1e-10 * params.weight
        )


@pytest.mark.parametrize(("dtype", "off"), [(jnp.float32, 2e-3), (jnp.float64, 1e-5)])
def test_the_interval_is_that_of_linear_programs(dtype, off, float64):
    params, track = UGVParams(), Track.sinusoid(0.25, 3.0).astype(float64)
    pose = placed(params, track, *drawn(params, float64, 40))
    mu = np.random.default_rng(1).uniform(0.05, 0.6, (2, 40))
    rows, right = map(np.asarray, chapter(params, pose))
    own = jax.tree.map(lambda of: of.astype(dtype) if of.dtype == float64 else of, (pose, (*mu,)))
    W, found = float(params.weight), jax.tree.map(np.asarray, jax.jit(safe_split)(params, *own))

    def solved(k, share=1.0, sign=1):
        cones = [[s, -share * mu[0, k], 0, 0] for s in (1, -1)]
        cones += [[0, 0, s, -share * mu[1, k]] for s in (1, -1)] + [[-1, 0, 1, 0], [1, 0, -1, 0]]
        A, b, limits = rows[k, 6:, :4], right[k, 6:] / W, [0, 0, 0, 0, 1, 1]
        return linprog([-sign, 0, sign, 0], cones, limits, A, b, [(None, None), (0, None)] * 2)

    for k, (_, low, high, use, _) in enumerate(zip(*found, strict=True)):
        ends = solved(k), solved(k, sign=-1)
        assert ends[0].success == (low <= high) == (use <= 1)
        if low <= high:
            np.testing.assert_allclose([ends[0].fun, -ends[1].fun], [low / W, high / W], atol=off)
        assert not np.isfinite(use) or solved(k, use + off).success
        assert use < off or not solved(k, min(use, 99.0) - off).success
    assert (found.low.dtype, 5 < np.sum(found.low <= found.high) < 35) == (dtype, True)


def test_a_slope_needs_its_tangent_and_less_has_a_status(float64):
    def split(slope, **given):
        pose = placed(UGVParams(), Track.incline(slope), 4.0, np.full(2, np.pi / 2))
        return safe_split(UGVParams(), pose, **{"friction": 0.25} | given)

    found = jax.jit(jax.value_and_grad(lambda slope: split(slope).friction_use))(0.3)
    np.testing.assert_allclose(found, [0.3 / 0.25, 1 / 0.25], rtol=1e-9)
    for slope, status in ((0.2, Status.OK), (0.3, Status.WHEEL_SLIP), (0.8, Status.ROLLOVER)):
        assert [split(slope).status, *np.isfinite(split(slope)[:3])] == [status, True, True, True]
    for name in ("friction", "min_grip", "max_torque"):
        with pytest.raises(ValueError, match=rf"{name} = -0\.1 is not accepted; accepted: numbers"):
            split(0.2, **{name: -0.1})


def test_slip_rollover_and_grounding_are_told(float64):
    params, flat = UGVParams(), Track.flat().astype(float64)
    upright = jnp.asarray([np.pi / 2, np.pi / 2])
    steep = Track.incline(0.6).astype(float64)
    assert equilibrium(params, flat, 4.0, upright, 0.0).status == Status.OK
    assert equilibrium(params, steep, 4.0, upright, 0.5).status == Status.WHEEL_SLIP
    # The front wheel pushes as hard as the rear one, but bears a ninth of the load.
    assert equilibrium(params, steep, 4.0, upright, 3.0).status == Status.OK
    top_heavy = UGVParams(wheel_mass=1.0, leg_length=0.4)
    short = jnp.asarray([np.pi / 6, np.pi / 6])
    folded = equilibrium(top_heavy, steep, 4.0, short, 5.0)
    assert folded.status == Status.OVERLAP
    np.testing.assert_allclose(folded.wheel_clearance, 0.83 - 0.8 * np.cos(np.pi / 6) - 0.56)
    folded = equilibrium(top_heavy, steep, 4.0, short, 5.0, solver=PoseSolver(overlap=True))
    assert (folded.status, folded.wheel_clearance) == (Status.ROLLOVER, np.inf)
    low = UGVParams(leg_length=0.1, wheel_radius=0.1)
    crest = Track.bump(0.35, 4.0, 0.4).astype(float64)
    state = equilibrium(low, crest, 4.4, upright, 50.0)
    assert state.clearance < 0
    assert state.status == Status.GROUNDED


@pytest.mark.long
def test_forces_differentiate(float64):
    params = UGVParams()
    x, angles = drawn(params, float64, 8)

    def torques(x, angles, wheel_radius, height):
        vehicle = UGVParams(wheel_radius=wheel_radius)
        pose = place(vehicle, Track.bump(height), x, angles, PoseSolver())
        state = balance(vehicle, pose, 0.8)
        return jnp.stack([state.torque, state.N_front, *state.leg_torques])

    def slopes_by(derivative):
        return jax.jit(jax.vmap(derivative(torques, argnums=(0, 1, 2, 3))))(x, angles, r, height)

    r, height = jnp.full(8, 0.28), jnp.full(8, 0.1)
    torque = jax.jit(jax.vmap(torques))
    slopes = slopes_by(jax.jacfwd)
    h = 1e-6
    point = [x, angles[:, 0], angles[:, 1], r, height]
    ours = [slopes[0], slopes[1][..., 0], slopes[1][..., 1], slopes[2], slopes[3]]
    for index, slope in enumerate(ours):
        values = []
        for sign in (1, -1):
            moved = [v + sign * h * (i == index) for i, v in enumerate(point)]
            values.append(torque(moved[0], jnp.stack(moved[1:3], -1), *moved[3:]))
        difference = (values[0] - values[1]) / (2 * h)
        np.testing.assert_allclose(slope, difference, rtol=1e-6, atol=1e-6 * params.weight)
    for one, other in zip(slopes, slopes_by(jax.jacrev), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * params.weight)
