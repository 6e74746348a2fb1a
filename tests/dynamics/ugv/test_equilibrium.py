"""Equilibrium: three systems agree, the work adds up, and the physics that needs no program."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

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
    wheel_turns,
)
from stickslip.dynamics.ugv.statics import SYSTEMS
from tests.dynamics.ugv.helpers import TRACKS, balanced, drawn, mirrored, placed, rows_of

GROUND = ("F_rear", "N_rear", "F_front", "N_front", "torque")


def mostly(quick: str, *others: str) -> pytest.MarkDecorator:
    """The ground of the quick run, and those that only the long one takes: each is a program."""
    rest = (pytest.param(name, marks=pytest.mark.long) for name in others)
    return pytest.mark.parametrize("name", [quick, *rest])


@mostly("ditch", "bump", "slope")
def test_three_systems_agree(float64, name):
    params, track = UGVParams(), TRACKS[name]().astype(float64)
    x, angles = drawn(params, float64)

    @jax.jit
    def all_three(x, angles):
        pose = place(params, track, x, angles, PoseSolver())
        return [balance(params, pose, 0.8, system) for system in SYSTEMS]

    closed, *others = all_three(x, angles)
    for key in GROUND:
        for other in others:
            difference = np.abs(getattr(closed, key) - getattr(other, key))
            assert np.max(difference) < 1e-10 * params.weight, key


@pytest.mark.long
def test_the_closed_form_solves_the_systems_of_random_vehicles(float64):
    random = np.random.default_rng(3)
    track = Track.bump().astype(float64)
    factors = jnp.asarray(random.uniform(0.5, 2.0, (7, 32)))
    names = ("body_length", "wheel_radius", "wheel_mass", "body_mass", "leg_mass", "gravity")
    default = UGVParams()
    fields = {
        name: getattr(default, name) * factor for name, factor in zip(names, factors, strict=False)
    }
    fields["leg_length"] = fields["body_length"] * jnp.asarray(random.uniform(0.2, 0.5, 32))
    vehicles = jax.tree.map(lambda v: jnp.broadcast_to(v, 32), UGVParams(**fields))
    x, angles = drawn(default, float64, 32, 3.5, 6.0)
    pose = jax.jit(jax.vmap(lambda p, x, a: place(p, track, x, a, PoseSolver())))(
        vehicles, x, angles
    )
    good = np.asarray(pose.status == Status.OK)
    assert good.sum() > 20
    forces = jax.vmap(ground_forces)(vehicles, pose)
    torque = -forces.F_rear * vehicles.wheel_radius
    weight = np.asarray(vehicles.weight)
    (rows, right), (all_rows, all_right) = jax.vmap(rows_of)(vehicles, pose)
    unknowns = jnp.stack([*forces, torque], -1)
    missing = jnp.einsum("nij,nj->ni", rows, unknowns) - right
    assert np.max(np.abs(missing)[good] / weight[good, None]) < 1e-12
    solution = jnp.linalg.solve(all_rows, all_right[..., None])[..., 0]
    ours = jnp.stack([*forces, torque], -1)
    theirs = solution[:, jnp.array([0, 1, 2, 3, 8])]
    assert np.max(np.abs(ours - theirs)[good] / weight[good, None]) < 1e-10


@mostly("bump", "sinusoid", "slope")
def test_the_motors_work_is_the_change_of_potential_energy(float64, name):
    """Virtual work along the track and by each leg: central differences of energy and turns."""
    params, track = UGVParams(), TRACKS[name]().astype(float64)
    odometer = Odometer.along(track, 0.0, 8.0)
    x, angles = drawn(params, float64, 32)

    @jax.jit
    def energy_and_turns(x, angles):
        pose = place(params, track, x, angles, PoseSolver())
        turns = wheel_turns(params, odometer, pose, angles)
        return pose.potential_energy(params), jnp.sum(turns, -1), angles

    state = balanced(params, track, x, angles)
    h = 1e-5
    for dx, da in ((1.0, [0.0, 0.0]), (0.0, [1.0, 0.0]), (0.0, [0.0, 1.0])):
        after, before = (
            energy_and_turns(x + sign * h * dx, angles + sign * h * jnp.asarray(da))
            for sign in (1, -1)
        )
        V, turned, moved = ((a - b) / (2 * h) for a, b in zip(after, before, strict=True))
        work = state.torque * turned + jnp.sum(state.leg_torques * moved, -1)
        np.testing.assert_allclose(work, V, rtol=1e-9, atol=1e-9 * params.weight)


def test_work_by_differentiation_agrees_to_rounding(float64):
    params, track = UGVParams(), Track.bump().astype(float64)
    odometer = Odometer.along(track, 0.0, 8.0)
    x, angles = drawn(params, float64, 16)

    def energy_and_turns(x, angles):
        pose = place(params, track, x, angles, PoseSolver())
        turns = wheel_turns(params, odometer, pose, angles)
        return pose.potential_energy(params), jnp.sum(turns, -1)

    slopes = jax.jit(jax.vmap(jax.jacrev(energy_and_turns, argnums=(0, 1))))(x, angles)
    (V_x, V_a), (turn_x, turn_a) = slopes
    state = balanced(params, track, x, angles)
    np.testing.assert_allclose(state.torque * turn_x, V_x, atol=1e-11 * params.weight)
    work = state.torque[:, None] * turn_a + state.leg_torques
    np.testing.assert_allclose(work, V_a, atol=1e-11 * params.weight)


def test_flat_ground_needs_no_torque_and_bears_by_lever_arms(float64):
    params = UGVParams()
    x, angles = drawn(params, float64)
    state = balanced(params, Track.flat().astype(float64), x, angles)
    assert np.max(np.abs(state.torque)) < 1e-12 * params.weight
    pose = state.pose
    masses = [params.wheel_mass, params.wheel_mass, params.leg_mass, params.leg_mass]
    points = [pose.rear.centre, pose.front.centre, pose.rear_leg, pose.front_leg]
    moment = sum(m * (p[:, 0] - pose.rear.x) for m, p in zip(masses, points, strict=True))
    moment = (moment + params.body_mass * (pose.body[:, 0] - pose.rear.x)) * params.gravity
    np.testing.assert_allclose(state.N_front, moment / (pose.front.x - pose.rear.x), rtol=1e-12)
    np.testing.assert_allclose(state.N_front + state.N_rear, params.weight, rtol=1e-13)


@pytest.mark.parametrize("slope", [-0.5, 0.1, 0.3, np.tan(np.radians(80))])
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


def test_a_motor_a_wheel_leaves_one_force_free(float64):
    """Every member of the family holds the vehicle, and is linear in the difference."""
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 16)
    pose = placed(params, track, x, angles)
    difference = jnp.asarray([-500.0, 0.0, 500.0])[:, None]
    family = jax.jit(ground_forces)(params, pose, difference)
    (rows, right), _ = rows_of(params, pose)
    forces = jnp.stack(family, -1)
    whole = jnp.array([0, 1, 4])
    missing = jnp.einsum("nij,knj->kni", rows[:, whole, :4], forces) - right[:, whole]
    assert np.max(np.abs(missing)) < 1e-11 * params.weight
    np.testing.assert_allclose(family.F_front - family.F_rear, difference + 0 * x, atol=1e-9)
    np.testing.assert_allclose(forces[0] + forces[2], 2 * forces[1], atol=1e-9)
    same = balanced(params, track, x, angles).forces
    np.testing.assert_allclose(forces[1], jnp.stack(same, -1), rtol=1e-12)


@pytest.mark.long
def test_leg_torques_are_the_hinges_own_moments_for_any_split(float64):
    """The legs' torques are linear in the split, so virtual work holds with unequal torques."""
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 8)

    def energy_and_turns(angles, x):
        pose = place(params, track, x, angles, PoseSolver())
        odometer = Odometer.along(track, 0.0, 8.0)
        return pose.potential_energy(params), wheel_turns(params, odometer, pose, angles)

    V_a, turns_a = jax.jit(jax.vmap(jax.jacfwd(energy_and_turns)))(angles, x)
    pose = placed(params, track, x, angles)
    forces = ground_forces(params, pose, 300.0)
    M = -params.wheel_radius * jnp.stack([forces.F_rear, forces.F_front], -1)
    work = jnp.einsum("nw,nwa->na", M, turns_a) + leg_torques(params, pose, forces)
    np.testing.assert_allclose(work, V_a, atol=1e-10 * params.weight)


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
    as_in_chapter = PoseSolver(overlap=True)
    folded = equilibrium(top_heavy, steep, 4.0, short, 5.0, solver=as_in_chapter)
    assert (folded.status, folded.wheel_clearance) == (Status.ROLLOVER, np.inf)
    low = UGVParams(leg_length=0.1, wheel_radius=0.1)
    crest = Track.bump(0.35, 4.0, 0.4).astype(float64)
    state = equilibrium(low, crest, 4.4, upright, 50.0)
    assert state.clearance < 0
    assert state.status == Status.GROUNDED


def test_a_friction_of_zero_slips_wherever_torque_is_needed(float64):
    params, track = UGVParams(), Track.bump().astype(float64)
    x, angles = drawn(params, float64, 16)
    held = balanced(params, track, x, angles, 0.0)
    wanted = np.where(held.wheel_clearance < 0, Status.OVERLAP, Status.WHEEL_SLIP)
    np.testing.assert_array_equal(held.status, wanted)


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
