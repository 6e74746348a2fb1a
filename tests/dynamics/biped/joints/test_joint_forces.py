"""Joint forces of given motions and torques: the reference file's, and mechanics body by body."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BODIES, kinematics
from stickslip.dynamics.biped.inertia import body_masses
from stickslip.dynamics.biped.joints.equations import body_equations, link_motion
from stickslip.dynamics.biped.joints.pins import JOINT_FORCES
from stickslip.dynamics.biped.links import LINK_OF_BODY
from tests.dynamics.biped.joints.robots import (
    COUNT,
    MOTIONS,
    by_reduced,
    default_robots,
    every_motion,
    random_instants,
    random_robots,
)
from tests.precision import mostly_single

PLACES = {
    "1-2": "E", "1-11": "ankle_bar", "2-3": "K", "2-5": "K", "5-11": "knee_bar",
    "5-12": "knee_bar", "10-12": "C_bar", "7-3": "C", "7-10": "C", "3-6": "F", "4-2": "H",
    "7-8": "crank_pin", "7-9": "rod_pin", "10-13": "slot_pin",
    "6-13": "D", "4-13": "D", "9-13": "B", "8-13": "A",
}  # fmt: skip
"""MODEL 1.1's pins, written again."""


def cross(a, b):
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def difference(got, want, size) -> float:
    """The largest difference, in parts of `size`."""
    return float(np.max(np.abs(np.asarray(got) - np.asarray(want)) / size))


def test_every_motion_agrees_with_the_reduced_equations(float64):
    robots, given = random_robots(), random_instants()
    got, want = every_motion(robots, given), by_reduced(robots, given)
    weight = np.asarray(robots.total_mass * robots.gravity)
    for motion in MOTIONS:
        for name, value in want[motion].items():
            found = getattr(got[motion], name)
            size = {"torque": weight * 0.03, "crank_acceleration": 300, "foot_acceleration": 9}
            assert difference(found, value, size.get(name, weight) + np.abs(value)) < 1e-9, (
                motion,
                name,
            )


@jax.jit
def equations_of(robots, angles):
    def one(params, angle):
        return body_equations(params, link_motion(params, angle))

    return jax.vmap(one)(robots, angles)


def test_the_whole_matrix_of_72_equations_has_the_same_solution(float64):
    robots, given = random_robots(), random_instants()
    got = every_motion(robots, given)["inverse"]
    forces, torque, ground, loads = map(np.asarray, equations_of(robots, given["theta"]))
    matrix = np.concatenate([forces, torque[..., None], ground], axis=-1).reshape(COUNT, 72, 72)
    motion = np.stack(
        [got.crank_acceleration, given["crank_rate"] ** 2, got.foot_acceleration, robots.gravity]
    )
    right = np.einsum("nbij,jn->nbi", loads, motion).reshape(COUNT, 72, 1)
    want = np.linalg.solve(matrix, right)[..., 0]
    rest = [got.torque, got.friction_force, got.normal_force, got.ankle_moment]
    found = np.concatenate([got.joint_forces, np.stack(rest, -1)], axis=1)
    assert difference(found, want, np.max(np.abs(want), axis=1, keepdims=True)) < 1e-9


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


def test_every_joint_force_is_the_reference_files(float64, reference):
    given, states = reference_instants(reference)
    got = every_motion(default_robots(), given)
    for system in ("inverse", "stick"):
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
    got = every_motion(default_robots(), given)
    names = {
        "alpha": "crank_acceleration",
        "foot_acceleration": "foot_acceleration",
        "friction": "friction_force",
        "normal": "normal_force",
        "ankle_moment": "ankle_moment",
        "zmp": "zmp",
    }
    for system, mode in (("stick", "stick"), ("slip", "slip")):
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


@pytest.mark.parametrize("system", MOTIONS)
def test_every_body_moves_as_its_forces_say(system, float64):
    """Newton and Euler body by body, forces by name, accelerations by differences in time."""
    robots, given = random_robots(), random_instants()
    got = every_motion(robots, given)[system]
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
    ground = np.stack([got.friction_force, got.normal_force], -1)
    net[:, 0] += ground
    moment[:, 0] += got.ankle_moment + cross(-centres[:, 0], ground)
    size = np.max(np.abs(np.asarray(got.joint_forces)), axis=1)[:, None]
    off = net - mass[..., None] * acceleration
    assert difference(off, 0, size[..., None]) < 1e-6
    spin = np.asarray(robots.inertia)[:, LINK_OF_BODY] * turning
    assert difference(moment - spin, 0, 0.5 * size) < 1e-6


@pytest.mark.parametrize("system", MOTIONS)
def test_the_motor_and_friction_do_all_the_work(system, float64):
    """dE/dt = T w + f v1 for a foot that slides at v1."""
    robots, given = random_robots(), random_instants()
    got = every_motion(robots, given)[system]
    speed = jnp.linspace(-1, 1, COUNT)
    rate = given["crank_rate"]
    work = rate_of_energy(
        robots, given["theta"], rate, speed, got.crank_acceleration, got.foot_acceleration
    )
    power = got.torque * rate + got.friction_force * speed
    assert difference(work, power, np.abs(np.asarray(got.torque * rate)) + 10) < 1e-9


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


def test_friction_of_a_sliding_foot_is_coulombs(float64):
    given = random_instants()
    got = every_motion(random_robots(), given)["slip"]
    want = -given["direction"] * given["mu_kinetic"] * got.normal_force
    assert difference(got.friction_force, want, 1 + np.abs(np.asarray(got.normal_force))) < 1e-12


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
        every_motion(robot, given)["inverse"] for robot in (robots, heavier, in_hip)
    )
    weight = robots.total_mass * robots.gravity
    assert difference(light.normal_force, weight, 1.0) < 1e-11
    assert difference(loaded.normal_force, weight + 15 * robots.gravity, 1.0) < 1e-11
    assert difference(loaded.joint_forces, same.joint_forces, 1.0) < 1e-9
    assert difference(loaded.joint_forces, light.joint_forces, 1.0) > 10


@mostly_single
def test_precision_is_that_of_what_is_given(dtype):
    given = default_robots(dtype.name), random_instants(dtype=dtype.name)
    batch = jax.eval_shape(lambda: every_motion(*given)["slip"])  # types are known uncompiled
    assert all(value.dtype == dtype for value in batch)
