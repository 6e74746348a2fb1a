"""The chapter's five systems against the reduced equations, the reference file and mechanics."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BODIES, kinematics
from stickslip.dynamics.biped.bodies.newton_euler import SYSTEMS
from stickslip.dynamics.biped.coefficients.inertia import body_masses
from stickslip.dynamics.biped.links import LINK_OF_BODY
from stickslip.dynamics.biped.mechanism.joints import JOINT_FORCES
from stickslip.dynamics.derived import rebuilt
from tests.dynamics.biped.helpers import default_params
from tests.dynamics.biped.joint_helpers import (
    COUNT,
    by_reduced,
    default_robots,
    every_system,
    random_instants,
    random_robots,
    slip,
    slips,
)
from tests.precision import mostly_single

SLIPPING = ("inverse_slip", "forward_slip")
PLACES = {
    "1-2": "E", "1-11": "ankle_bar", "2-3": "K", "2-5": "K", "5-11": "knee_bar",
    "5-12": "knee_bar", "10-12": "C_bar", "7-3": "C", "7-10": "C", "3-6": "F", "4-2": "H",
    "7-8": "crank_pin", "7-9": "rod_pin", "10-13": "slot_pin",
    "6-13": "D", "4-13": "D", "9-13": "B", "8-13": "A",
}  # fmt: skip
"""MODEL 1.1's pins, written again."""


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def apart(got, want, size) -> float:
    """The largest difference, in parts of `size`."""
    return float(np.max(np.abs(np.asarray(got) - np.asarray(want)) / size))


@pytest.mark.parametrize("solver", [pytest.param("refined", marks=pytest.mark.long), "groups"])
def test_every_system_agrees_with_the_reduced_equations(solver, float64):
    robots, given = random_robots(), random_instants()
    got, want = every_system(robots, given, solver), by_reduced(robots, given)
    weight = np.asarray(robots.total_mass * robots.gravity)
    for system in SYSTEMS:
        for name, value in want[system].items():
            found = getattr(got[system], name)
            if found is None:
                continue
            size = {"torque": weight * 0.03, "crank_acceleration": 300, "foot_acceleration": 9}
            assert apart(found, value, size.get(name, weight) + np.abs(value)) < 1e-9, (
                system,
                name,
            )


def same(got, want):
    size = np.max(np.abs(np.asarray(want.joint_forces)), axis=1, keepdims=True)
    assert apart(got.joint_forces, want.joint_forces, size) < 1e-9
    for name in ("ankle_moment", "zmp", "crank_acceleration", "foot_acceleration"):
        if getattr(want, name) is not None:
            value = np.asarray(getattr(want, name))
            assert apart(getattr(got, name), value, 1 + np.abs(value)) < 1e-9, name


@pytest.mark.long
def test_the_whole_matrix_gives_the_same_forces_as_the_groups(float64):
    robots, given = random_robots(), random_instants()
    whole, groups = (every_system(robots, given, solver) for solver in ("refined", "groups"))
    for system in SYSTEMS:
        same(whole[system], groups[system])


@pytest.mark.long
@pytest.mark.parametrize(
    "solver", ["lu", *(pytest.param(s, marks=pytest.mark.long) for s in ("scaled", "block"))]
)
def test_the_other_solvers_give_the_same_forces(solver, float64):
    robots, given = random_robots(), random_instants()
    same(slips(robots, given, solver), every_system(robots, given)["forward_slip"])


def reference_instants(reference):
    """The reference file's eight states, 32 times each."""
    given = random_instants()
    states = [reference["states"][i % 8] for i in range(COUNT)]
    names = {"theta": "theta", "crank_rate": "omega", "torque": "torque"}
    names |= {"mu_kinetic": "mu_kinetic", "direction": "slide_velocity"}
    for ours, theirs in names.items():
        given[ours] = jnp.asarray([state[theirs] for state in states])
    given["direction"] = jnp.sign(given["direction"])
    given["crank_acceleration"] = jnp.asarray([state["stick"]["alpha"] for state in states])
    given["foot_acceleration"] = jnp.zeros(COUNT)
    return given, states[:8]


@pytest.mark.parametrize("solver", [pytest.param("refined", marks=pytest.mark.long), "groups"])
def test_every_joint_force_is_the_reference_files(solver, float64, reference):
    given, states = reference_instants(reference)
    got = every_system(default_robots(), given, solver)
    for system in ("inverse", "inverse_ground", "forward_stick"):
        for i, state in enumerate(states):
            ours = dict(zip(JOINT_FORCES, np.asarray(got[system].joint_forces[i]), strict=True))
            theirs = state["stick"]["joint_forces"]
            assert len(theirs) == 66
            size = max(abs(force["value"]) for force in theirs)
            for force in theirs:
                name = force["on"], force["by"], force["axis"]
                assert ours[name] == pytest.approx(force["value"], rel=1e-9, abs=1e-9 * size), name


def test_accelerations_and_ground_force_are_the_reference_files(float64, reference):
    given, states = reference_instants(reference)
    got = every_system(default_robots(), given)
    names = {
        "alpha": "crank_acceleration",
        "foot_acceleration": "foot_acceleration",
        "friction": "friction_force",
        "normal": "normal_force",
        "ankle_moment": "ankle_moment",
        "zmp": "zmp",
    }
    for system, mode in (("forward_stick", "stick"), ("forward_slip", "slip")):
        for i, state in enumerate(states):
            for theirs, ours in names.items():
                if theirs in state[mode]:
                    value = getattr(got[system], ours)[i]
                    assert value == pytest.approx(state[mode][theirs], rel=1e-9, abs=1e-10)


@jax.jit
def along_motion(robots, theta, rate, alpha, a1, time):
    """Kinematics on the way theta + rate t + alpha t^2 / 2, the foot slid by a1 t^2 / 2."""

    def one(robot, theta, rate, alpha, a1):
        now = kinematics(robot, theta + rate * time + alpha * time**2 / 2)
        return now.centres.at[:, 0].add(a1 * time**2 / 2), now.angles, now

    return jax.vmap(one)(robots, theta, rate, alpha, a1)


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_body_moves_as_its_forces_say(system, float64):
    """Newton and Euler body by body, forces by name, accelerations by differences in time."""
    robots, given = random_robots(), random_instants()
    got = every_system(robots, given)[system]
    motion = robots, given["theta"], given["crank_rate"]
    motion += got.crank_acceleration, got.foot_acceleration
    h = 5e-5
    before, now, after = (along_motion(*motion, time) for time in (-h, 0.0, h))
    acceleration = np.asarray(after[0] - 2 * now[0] + before[0]) / h**2
    b, n, a = np.unwrap(np.stack([before[1], now[1], after[1]]), axis=0)
    turning = (a - 2 * n + b) / h**2
    centres, pins, hip = np.asarray(now[0]), now[2].pins, np.asarray(now[2].hip_pins)
    along = hip[:, 1] - hip[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], -1) / np.linalg.norm(along, axis=1)[:, None]
    axes = {"x": np.array([1.0, 0.0]), "y": np.array([0.0, 1.0]), "normal": normal}
    net, moment = np.zeros((COUNT, 24, 2)), np.zeros((COUNT, 24))
    for i, (on, by, axis) in enumerate(JOINT_FORCES):
        place = PLACES[f"{on.rstrip('p')}-{by.rstrip('p')}"]
        leg = 1 if "p" in on + by else 0
        point = hip[:, "ABD".index(place)] if place in "ABD" else getattr(pins, place)[:, leg]
        force = np.asarray(got.joint_forces)[:, i, None] * axes[axis]
        for body, sign in ((BODIES.index(on), 1), (BODIES.index(by), -1)):
            net[:, body] += sign * force
            moment[:, body] += sign * cross(np.asarray(point) - centres[:, body], force)
    moment[:, BODIES.index("8")] += got.torque
    moment[:, BODIES.index("13")] -= got.torque
    mass = np.asarray(jax.vmap(body_masses)(robots))
    net[:, :, 1] -= mass * np.asarray(robots.gravity)[:, None]
    if system == "inverse":  # the foot's ground force is not among its unknowns
        first = 1
    else:
        first = 0
        ground = np.stack([got.friction_force, got.normal_force], -1)
        net[:, 0] += ground
        moment[:, 0] += got.ankle_moment + cross(-centres[:, 0], ground)
    size = np.max(np.abs(np.asarray(got.joint_forces)), axis=1)[:, None]
    off = net - mass[..., None] * acceleration
    assert apart(off[:, first:], 0, size[..., None]) < 1e-6
    spin = np.asarray(robots.inertia)[:, LINK_OF_BODY] * turning
    assert apart((moment - spin)[:, first:], 0, 0.5 * size) < 1e-6


@pytest.mark.parametrize("system", SYSTEMS[1:])
def test_the_motor_and_friction_do_all_the_work(system, float64):
    """dE/dt = T w + f v1 for a foot that slides at v1."""
    robots, given = random_robots(), random_instants()
    got = every_system(robots, given)[system]
    speed = jnp.linspace(-1, 1, COUNT)
    rate = given["crank_rate"]
    work = rate_of_energy(robots, given["theta"], rate, speed, *got[-2:])
    power = got.torque * rate + got.friction_force * speed
    assert apart(work, power, np.abs(np.asarray(got.torque * rate)) + 10) < 1e-9


@jax.jit
def rate_of_energy(robots, theta, rate, speed, alpha, a1):
    """Time derivative of kinetic and potential energy on the given motion."""

    def energy(robot, theta, rate, speed):
        def place(angle):
            now = kinematics(robot, angle)
            return now.centres, now.angles

        (centres, _), (slopes, turning) = jax.jvp(place, (theta,), (rate,))
        velocity = slopes.at[:, 0].add(speed)
        mass, inertia = body_masses(robot), robot.inertia[LINK_OF_BODY]
        moving = mass * jnp.sum(velocity**2, axis=1) + inertia * turning**2
        return jnp.sum(moving / 2 + mass * robot.gravity * centres[:, 1])

    def one(robot, theta, rate, speed, alpha, a1):
        return jax.jvp(
            lambda *state: energy(robot, *state), (theta, rate, speed), (rate, alpha, a1)
        )[1]

    return jax.vmap(one)(robots, theta, rate, speed, alpha, a1)


@pytest.mark.parametrize("system", SLIPPING)
def test_friction_of_a_sliding_foot_is_coulombs(system, float64):
    given = random_instants()
    got = every_system(random_robots(), given)[system]
    want = -given["direction"] * given["mu_kinetic"] * got.normal_force
    assert apart(got.friction_force, want, 1 + np.abs(np.asarray(got.normal_force))) < 1e-12


def test_at_rest_without_gravity_no_joint_bears_a_force(float64):
    robots = rebuilt(random_robots(), gravity=jnp.zeros(COUNT))  # which no robot may have
    still = {name: jnp.zeros(COUNT) for name in random_instants()}
    still |= {"theta": random_instants()["theta"]}
    for system, got in every_system(robots, still).items():
        forces = [value for value in got if value is not None]
        assert max(float(jnp.max(jnp.abs(value))) for value in forces) == 0.0, system


def test_at_rest_the_ground_bears_the_weight_and_the_pins_bear_a_payload(float64):
    given = random_instants() | {
        "crank_rate": jnp.zeros(COUNT),
        "crank_acceleration": jnp.zeros(COUNT),
        "foot_acceleration": jnp.zeros(COUNT),
    }
    robots = random_robots()
    heavier = replace(robots, payload=robots.payload + 15.0)
    in_hip = replace(robots, mass=robots.mass.at[:, 12].add(15.0))
    light, loaded, same = (
        every_system(robot, given)["inverse_ground"] for robot in (robots, heavier, in_hip)
    )
    weight = robots.total_mass * robots.gravity
    assert apart(light.normal_force, weight, 1.0) < 1e-11
    assert apart(loaded.normal_force, weight + 15 * robots.gravity, 1.0) < 1e-11
    assert apart(loaded.joint_forces, same.joint_forces, 1.0) < 1e-9
    assert apart(loaded.joint_forces, light.joint_forces, 1.0) > 10


@mostly_single
def test_precision_is_that_of_what_is_given(dtype):
    given = default_robots(dtype.name), random_instants(dtype=dtype.name)
    batch = jax.eval_shape(lambda: slips(*given))  # types are known uncompiled
    assert all(value.dtype == dtype for value in batch)


@pytest.mark.long
def test_one_by_one_is_as_in_a_batch(float64):
    given, params = random_instants(), default_params()
    batch = slips(default_robots(), given)
    for i in (0, COUNT - 1):
        one = slip(params, jax.tree.map(lambda leaf, i=i: leaf[i], given))
        size = float(jnp.max(jnp.abs(batch.joint_forces[i])))
        for got, want in zip(one, batch, strict=True):
            assert apart(got, want[i], size) < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("derivative", [jax.jacfwd, pytest.param(jax.grad, marks=pytest.mark.long)])
def test_derivatives_are_those_of_finite_differences(derivative, float64):
    params = default_params()

    @jax.jit
    def load(inputs):
        theta, rate, torque, mu, density, tibia = inputs
        robot = replace(params, mass=params.mass * density, tibia=params.tibia * tibia)
        values = {"theta": theta, "crank_rate": rate, "torque": torque, "mu_kinetic": mu}
        found = slip(robot, values | {"direction": jnp.ones_like(mu)})
        shares = jnp.cos(jnp.arange(68.0))
        return shares @ found.joint_forces + found.zmp + found.crank_acceleration

    at, h = jnp.asarray([2.1, 3.0, 0.7, 0.2, 1.1, 1.001]), 1e-6
    slope = jax.jit(derivative(load))(at)
    for i, step in enumerate(np.eye(6) * h):
        difference = (load(at + step) - load(at - step)) / (2 * h)
        assert slope[i] == pytest.approx(float(difference), rel=1e-6, abs=1e-6)
