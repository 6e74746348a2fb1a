"""Random robots and instants for the tests of joint forces."""

from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import (
    BipedParams,
    forward_dynamics,
    ground_moment,
    inverse_dynamics,
    prepare,
    reduced_inertia,
)
from stickslip.dynamics.biped.contact import System, Torque, ankle_moment, at_instant
from stickslip.dynamics.biped.links import least_closure
from stickslip.dynamics.biped.params import NON_NEGATIVE, POSITIVE
from tests.dynamics.biped.helpers import default_params

COUNT = 256
"""Robots, and instants, in every call of `every_motion`."""

LENGTHS = tuple(n for n in (*POSITIVE, *NON_NEGATIVE) if n not in ("gravity", "payload"))


@lru_cache
def random_robots(seed: int = 0) -> BipedParams:
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
    margin = np.asarray(_margins(robots))
    kept = np.flatnonzero(margin > 1e-2)[:COUNT]
    if kept.size < COUNT:
        raise ValueError(f"only {kept.size} of {many} random robots close")
    return jax.tree.map(lambda leaf: leaf[kept], robots)


def default_robots(dtype: str = "float64") -> BipedParams:
    """The default robot 256 times."""
    return jax.tree.map(
        lambda leaf: jnp.broadcast_to(leaf, (COUNT, *jnp.shape(leaf))), default_params(dtype)
    )


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


MOTIONS = ("inverse", "stick", "slip")
"""A motion is given; a torque is, and the foot is at rest, or slides."""


class Forces(NamedTuple):
    """All forces and accelerations of one instant."""

    joint_forces: jax.Array
    torque: jax.Array
    friction_force: jax.Array
    normal_force: jax.Array
    zmp: jax.Array
    ankle_moment: jax.Array
    crank_acceleration: jax.Array
    foot_acceleration: jax.Array


@jax.jit
def every_motion(robots: BipedParams, given: dict[str, jax.Array]) -> dict[str, Forces]:
    """MOTIONS of each robot at its instant."""

    def one(params, at):
        theta, rate, torque, way = at["theta"], at["crank_rate"], at["torque"], at["direction"]
        alpha, a1, mu = at["crank_acceleration"], at["foot_acceleration"], at["mu_kinetic"]
        zero, lever = jnp.zeros_like(theta), ground_moment(params, theta)

        def forces(found, torque, alpha, a1):
            moment = ankle_moment(params, lever, rate, alpha, a1)
            ground = found.friction_force, found.normal_force, found.zmp, moment
            return Forces(found.joint_forces, torque, *ground, alpha, a1)

        inverse = inverse_dynamics(params, theta, rate, alpha, zero, a1, outputs="joints")
        found = {"inverse": forces(inverse, inverse.torque, alpha, a1)}
        now = forward_dynamics(params, theta, rate, way, torque, mu, mu, outputs="joints")
        found["slip"] = forces(now, torque, now.crank_acceleration, now.foot_acceleration)
        system = System(prepare(params), Scene.grip(), Torque(torque), zero)
        held = at_instant(system, None, theta, rate, zero, "joints")
        forces_of = held.motion._asdict() | {"zmp": held.zmp, "joint_forces": held.joint_forces}
        accelerations = held.motion.crank_acceleration, held.motion.foot_acceleration
        found["stick"] = forces(SimpleNamespace(**forces_of), torque, *accelerations)
        return found

    return jax.vmap(one)(robots, given)


@jax.jit
def reduced_along(robots: BipedParams, angles: jax.Array):
    """M, dM, P, dP, Y, dY of each robot at its angle."""
    return jax.vmap(reduced_inertia)(robots, angles)


def by_reduced(robots: BipedParams, given: dict[str, jax.Array]) -> dict[str, dict[str, Any]]:
    """What MODEL 1.4 says of every motion, written out again with linear solves in numpy."""
    M, dM, P, dP, Y, dY = map(np.asarray, reduced_along(robots, given["theta"]))
    at = {name: np.asarray(value) for name, value in given.items()}
    square, mass, g = (
        at["crank_rate"] ** 2,
        np.asarray(robots.total_mass),
        np.asarray(robots.gravity),
    )
    signed = at["direction"] * at["mu_kinetic"]
    zero = np.zeros_like(M)

    def described(alpha, a1):
        return {
            "torque": M * alpha + P * a1 + dM * square / 2 + g * Y,
            "friction_force": P * alpha + mass * a1 + dP * square,
            "normal_force": mass * g + Y * alpha + dY * square,
            "crank_acceleration": alpha,
            "foot_acceleration": a1,
        }

    alpha = at["crank_acceleration"]
    held = described(alpha, at["foot_acceleration"])
    drive = at["torque"] - dM * square / 2 - g * Y
    drag = -dP * square - signed * (mass * g + dY * square)
    matrix = np.stack([np.stack([M, P], -1), np.stack([P + signed * Y, mass], -1)], -2)
    both = np.linalg.solve(matrix, np.stack([drive, drag], -1)[..., None])[..., 0]
    return {
        "inverse": held,
        "stick": described(drive / M, zero),
        "slip": described(*both.T),
    }


@jax.jit
def _margins(robots: BipedParams) -> jax.Array:
    return jax.vmap(lambda robot: least_closure(robot, 128)[0])(robots)
