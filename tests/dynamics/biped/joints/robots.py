"""Random robots and instants for the Newton-Euler tests."""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BipedParams, reduced_inertia
from stickslip.dynamics.biped.joints.newton_euler import GIVEN, SYSTEMS, NewtonEuler, newton_euler
from stickslip.dynamics.biped.links import least_closure
from stickslip.dynamics.biped.params import NON_NEGATIVE, POSITIVE
from tests.dynamics.biped.helpers import default_params

COUNT = 256
"""Robots, and instants, in every call of `every_system`."""

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
        "mu_kinetic": rng.uniform(0, 0.6, COUNT),
        "direction": rng.choice([-1.0, 1.0], COUNT),
    }
    return {name: jnp.asarray(value, dtype) for name, value in values.items()}


@jax.jit
def every_system(robots: BipedParams, given: dict[str, jax.Array]) -> dict[str, NewtonEuler]:
    """All five systems for each robot and instant."""

    def one(params, values):
        def solve(system):
            known = {name: values[name] for name in GIVEN[system]}
            theta, rate = values["theta"], values["crank_rate"]
            return newton_euler(params, theta, rate, system=system, **known)

        return {system: solve(system) for system in SYSTEMS}

    return jax.vmap(one)(robots, given)


def _slip(params, values):
    given = {name: values[name] for name in ("torque", "mu_kinetic", "direction")}
    theta, rate = values["theta"], values["crank_rate"]
    return newton_euler(params, theta, rate, system="forward_slip", **given)


@jax.jit
def slip(params: BipedParams, values: dict[str, jax.Array]) -> NewtonEuler:
    """One robot that slides at one instant (eq. 36)."""
    return _slip(params, values)


@jax.jit
def slips(robots: BipedParams, given: dict[str, jax.Array]) -> NewtonEuler:
    """The same for each robot and instant."""
    return jax.vmap(_slip)(robots, given)


@jax.jit
def reduced_along(robots: BipedParams, angles: jax.Array):
    """M, dM, P, dP, Y, dY of each robot at its angle."""
    return jax.vmap(reduced_inertia)(robots, angles)


def by_reduced(robots: BipedParams, given: dict[str, jax.Array]) -> dict[str, dict[str, Any]]:
    """What MODEL 1.4 says of every system, written out again with linear solves in numpy."""
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
    normal = described(alpha, zero)["normal_force"]
    slide = (-signed * normal - P * alpha - dP * square) / mass
    drive = at["torque"] - dM * square / 2 - g * Y
    drag = -dP * square - signed * (mass * g + dY * square)
    matrix = np.stack([np.stack([M, P], -1), np.stack([P + signed * Y, mass], -1)], -2)
    both = np.linalg.solve(matrix, np.stack([drive, drag], -1)[..., None])[..., 0]
    return {
        "inverse": held,
        "inverse_ground": held,
        "inverse_slip": described(alpha, slide),
        "forward_stick": described(drive / M, zero),
        "forward_slip": described(*both.T),
    }


@jax.jit
def _margins(robots: BipedParams) -> jax.Array:
    return jax.vmap(lambda robot: least_closure(robot, 128)[0])(robots)
