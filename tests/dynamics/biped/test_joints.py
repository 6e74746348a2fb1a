"""Joint forces body by body and beside the reference file; inertia functions of the full system."""

from dataclasses import replace
from functools import lru_cache, partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics import biped
from stickslip.dynamics.biped.contact import ankle_moment
from stickslip.dynamics.biped.inertia import body_masses
from stickslip.dynamics.biped.joints import DifferencedInertia, JointInertia, link_motion
from stickslip.dynamics.biped.links import LINK_OF_BODY, least_closure
from stickslip.dynamics.names import LENGTHS
from tests.dynamics.biped.helpers import default_params

COUNT = 256
"""Robots, and instants, in every call."""


@lru_cache
def random_robots(seed: int = 0) -> biped.BipedParams:
    """256 robots with lengths within 5 % of the default's that close, all masses at random."""
    rng, base = np.random.default_rng(seed), default_params()
    many = 2 * COUNT

    def spread(name, low, high):
        return jnp.asarray(getattr(base, name)) * rng.uniform(low, high, many)

    robots = replace(
        base,
        **{name: spread(name, 0.95, 1.05) for name in LENGTHS},
        mass=jnp.asarray(rng.uniform(0.05, 2.0, (many, 13))),
        centre=base.centre + rng.normal(0, 0.02, (many, 13, 2)),
        inertia=jnp.asarray(rng.uniform(0.0, 5e-3, (many, 13))),
        payload=jnp.asarray(rng.uniform(0.0, 10.0, many)),
        gravity=spread("gravity", 0.3, 2.0),
    )
    margin = np.asarray(jax.jit(jax.vmap(lambda robot: least_closure(robot, 128)[0]))(robots))
    kept = np.flatnonzero(margin > 1e-2)[:COUNT]
    if kept.size < COUNT:
        raise ValueError(f"only {kept.size} of {many} random robots close")
    return jax.tree.map(lambda leaf: leaf[kept], robots)


def default_robots(dtype: str = "float64") -> biped.BipedParams:
    """The default robot 256 times."""
    one = default_params(dtype)
    return jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (COUNT, *jnp.shape(leaf))), one)


def random_instants(seed: int = 1, dtype: str = "float64") -> dict[str, jax.Array]:
    """Any angle of the turn, walking and much faster, sliding either way."""
    rng = np.random.default_rng(seed)
    values = {
        "theta": rng.uniform(0, 2 * np.pi, COUNT),
        "crank_rate": rng.uniform(-8, 8, COUNT),
        "torque": rng.uniform(-5, 5, COUNT),
        "crank_acceleration": rng.uniform(-80, 80, COUNT),
        "foot_acceleration": rng.uniform(-10, 10, COUNT),
        "mu_kinetic": rng.uniform(0, 0.3, COUNT),
        "direction": rng.choice([-1.0, 1.0], COUNT),
    }
    return {name: jnp.asarray(value, dtype) for name, value in values.items()}


def moment_of(params, at, *accelerations):
    """The ground's about the ankle; the zero-moment point is 0 where the ground would pull."""
    lever = biped.ground_moment(params, at["theta"])
    return ankle_moment(params, lever, at["crank_rate"] ** 2, *accelerations)


@jax.jit
def by_motion(robots, given):
    """Inverse dynamics of each robot at its instant."""

    def one(params, at):
        accelerations = at["crank_acceleration"], at["foot_acceleration"]
        motion = at["theta"], at["crank_rate"], accelerations[0], 0.0, accelerations[1]
        found = biped.inverse_dynamics(params, *motion, outputs="joints")
        return found, *accelerations, found.torque, moment_of(params, at, *accelerations)

    return jax.vmap(one)(robots, given)


@jax.jit
def by_torque(robots, given):
    """Forward dynamics of each robot at its instant, its foot sliding."""

    def one(params, at):
        state = at["theta"], at["crank_rate"], at["direction"], at["torque"]
        friction = at["mu_kinetic"], at["mu_kinetic"]
        found = biped.forward_dynamics(params, *state, *friction, outputs="joints")
        accelerations = found.crank_acceleration, found.foot_acceleration
        return found, *accelerations, at["torque"], moment_of(params, at, *accelerations)

    return jax.vmap(one)(robots, given)


@jax.jit
def reduced_along(robots, angles):
    """M, dM, P, dP, Y, dY of each robot at its angle; the ground's moment."""
    of = biped.reduced_inertia, biped.ground_moment
    return [jax.vmap(one)(robots, angles) for one in of]


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


def test_the_joints_are_those_of_the_reference_file_and_two_slots(reference):
    names = [(f["on"], f["by"], f["axis"]) for f in reference["states"][0]["stick"]["joint_forces"]]
    assert len(biped.JOINT_FORCES) == len(set(biped.JOINT_FORCES)) == 68
    slots = {("10", "13", "normal"), ("10p", "13", "normal")}
    assert set(biped.JOINT_FORCES) == set(names) | slots


def test_every_joint_force_is_the_reference_files(float64, reference):
    states = reference["states"]
    inverse = jax.jit(jax.vmap(partial(biped.inverse_dynamics, default_params(), outputs="joints")))
    motions = [[state["theta"], state["omega"], state["stick"]["alpha"]] for state in states]
    found = inverse(*jnp.asarray(motions).T).joint_forces
    for state, forces in zip(states, np.asarray(found), strict=True):
        ours = dict(zip(biped.JOINT_FORCES, forces, strict=True))
        theirs = state["stick"]["joint_forces"]
        assert len(theirs) == 66
        size = max(abs(force["value"]) for force in theirs)
        for force in theirs:
            name = force["on"], force["by"], force["axis"]
            assert ours[name] == pytest.approx(force["value"], rel=1e-9, abs=1e-9 * size), name


@jax.jit
def along_motion(robots, theta, rate, alpha, a1, time):
    """Kinematics on the way theta + rate t + alpha t^2 / 2, the foot slid by a1 t^2 / 2."""

    def one(robot, theta, rate, alpha, a1):
        now = biped.kinematics(robot, theta + rate * time + alpha * time**2 / 2)
        return now.centres.at[:, 0].add(a1 * time**2 / 2), now.angles, now

    return jax.vmap(one)(robots, theta, rate, alpha, a1)


@pytest.mark.parametrize("given_by", [by_motion, by_torque])
def test_every_body_moves_as_its_forces_say(given_by, float64):
    """Newton and Euler body by body, forces by name, accelerations by differences in time."""
    robots, given = random_robots(), random_instants()
    got, *accelerations, torque, ankle = given_by(robots, given)
    motion = robots, given["theta"], given["crank_rate"], *accelerations
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
    for i, (on, by, axis) in enumerate(biped.JOINT_FORCES):
        place = PLACES[f"{on.rstrip('p')}-{by.rstrip('p')}"]
        leg = 1 if "p" in on + by else 0
        point = hip[:, "ABD".index(place)] if place in "ABD" else getattr(pins, place)[:, leg]
        force = np.asarray(got.joint_forces)[:, i, None] * axes[axis]
        for body, sign in ((biped.BODIES.index(on), 1), (biped.BODIES.index(by), -1)):
            net[:, body] += sign * force
            moment[:, body] += sign * cross(np.asarray(point) - centres[:, body], force)
    moment[:, biped.BODIES.index("8")] += torque
    moment[:, biped.BODIES.index("13")] -= torque
    mass = np.asarray(jax.vmap(body_masses)(robots))
    net[:, :, 1] -= mass * np.asarray(robots.gravity)[:, None]
    ground = np.stack([got.friction_force, got.normal_force], -1)
    net[:, 0] += ground
    moment[:, 0] += ankle + cross(-centres[:, 0], ground)
    size = np.max(np.abs(np.asarray(got.joint_forces)), axis=1)[:, None]
    off = net - mass[..., None] * acceleration
    assert difference(off, 0, size[..., None]) < 1e-6
    spin = np.asarray(robots.inertia)[:, LINK_OF_BODY] * turning
    assert difference(moment - spin, 0, 0.5 * size) < 1e-6


@jax.jit
def along(robots, angles):
    """at, moment_at of each robot at its angle."""

    def one(params, angle):
        inertia = JointInertia(params)
        return inertia.at(angle), inertia.moment_at(angle)

    return jax.vmap(one)(robots, angles)


@pytest.mark.parametrize("make", [random_robots, default_robots])
def test_exact_motion_gives_the_reduced_functions_and_the_grounds_moment(float64, make):
    robots, angles = make(), random_instants()["theta"]
    found = along(robots, angles)
    assert isinstance(found[0], biped.ReducedInertia)
    for got, want in zip(found, reduced_along(robots, angles), strict=True):
        for name, one, exact in zip(want._fields, got, want, strict=True):
            size = float(jnp.max(jnp.abs(exact)))
            np.testing.assert_allclose(one, exact, rtol=1e-9, atol=1e-12 * size, err_msg=name)


STEP = 1e-3


def test_differences_err_in_the_momenta_and_break_virtual_power(float64):
    robots, given = default_robots(), random_instants()
    exact, _ = reduced_along(robots, given["theta"])
    by_differences = jax.vmap(lambda params, angle: JointInertia(params, STEP).at(angle))
    found = jax.jit(by_differences)(robots, given["theta"])
    assert isinstance(found, DifferencedInertia)
    for name in ("M", "P", "Y"):
        off = jnp.max(jnp.abs(getattr(found, name) - getattr(exact, name)))
        assert STEP * 0.1 < float(off) < STEP * 5, name
    for name in ("P", "Y"):  # the crank's: virtual power of the exact geometry
        off = getattr(found, f"{name}_crank") - getattr(exact, name)
        assert float(jnp.max(jnp.abs(off))) < 1e-12


@partial(jax.jit, static_argnums=2)
def motion_along(params, angles, step=None):
    return jax.vmap(lambda angle: link_motion(params, angle, step))(angles)


def test_the_chapters_differences_are_of_first_order_also_where_an_angle_jumps_by_a_turn(float64):
    params, angles = default_params(), jnp.linspace(0, 2 * np.pi, 90)
    exact = motion_along(params, angles)
    assert np.any(np.abs(np.diff(exact[0][1], axis=0)) > 6)  # an angle does jump
    off = {}
    for step in (2e-3, 1e-3):
        gap = jax.tree.map(jnp.subtract, motion_along(params, angles, step)[1:], exact[1:])
        off[step] = [float(jnp.max(jnp.abs(leaf))) for leaf in jax.tree.leaves(gap)]
    assert np.array(off[2e-3]) / np.array(off[1e-3]) == pytest.approx(2.0, abs=0.02)
    assert max(off[1e-3]) < 0.02
