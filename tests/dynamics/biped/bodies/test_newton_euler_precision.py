"""What single precision, other scales and positions near a dead one do to the solvers."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.bodies.newton_euler import condition_number
from tests.dynamics.biped.helpers import default_params
from tests.dynamics.biped.joint_helpers import (
    COUNT,
    LENGTHS,
    default_robots,
    random_instants,
    slips,
)

pytestmark = pytest.mark.long

SCALES = [(1.0, 1.0), (1e-3, 1e-6), (1e3, 1e6), (1e-3, 1e6), (1e3, 1e-6)]


def scaled(params: BipedParams, length: float, mass: float) -> BipedParams:
    """The same robot, lengths and masses times a factor."""
    lengths = {name: getattr(params, name) * length for name in LENGTHS}
    masses = {"mass": params.mass * mass, "inertia": params.inertia * mass * length**2}
    return replace(params, **lengths, **masses, centre=params.centre * length)


def same_motion(given, length: float, mass: float):
    """Instants of the same motion at another scale: time goes with the root of length."""
    factors = {"crank_rate": length**-0.5, "torque": mass * length}
    return {name: value * factors.get(name, 1.0) for name, value in given.items()}


def worst(got, want, length: float = 1.0, mass: float = 1.0, size=1.0) -> dict[str, float]:
    """Largest errors, forces by the largest one, accelerations by 10 (crank: 10 / size) or more.

    length, mass: what `want` is to be scaled by.
    """
    forces = np.asarray(want.joint_forces) * mass
    off = np.abs(np.asarray(got.joint_forces, float) - forces)
    found = {"forces": np.max(off / np.max(np.abs(forces), axis=1, keepdims=True))}
    for name, unit in (("crank_acceleration", 1 / length), ("foot_acceleration", 1.0)):
        value = np.asarray(getattr(want, name)) * unit
        least = 10 * unit / (size if name == "crank_acceleration" else 1.0)
        error = np.abs(np.asarray(getattr(got, name), float) - value)
        found[name] = np.max(error / (least + np.abs(value)))
    return {name: float(value) for name, value in found.items()}


@pytest.mark.parametrize(("length", "mass"), SCALES[1:])
def test_forces_scale_with_mass_and_accelerations_with_length(length, mass, float64):
    given, robots = random_instants(), default_robots()
    got = slips(scaled(robots, length, mass), same_motion(given, length, mass))
    assert max(worst(got, slips(robots, given), length, mass).values()) < 1e-11


@pytest.mark.parametrize(("length", "mass"), SCALES)
def test_single_precision_keeps_its_digits_at_every_scale(length, mass):
    """Measured, worst of 256 instants: forces 3e-5, accelerations 5e-5."""
    with jax.enable_x64(False):
        robots, given = default_robots("float32"), random_instants(dtype="float32")
        robots, given = scaled(robots, length, mass), same_motion(given, length, mass)
        got = jax.tree.map(np.asarray, slips(robots, given))
        given = jax.tree.map(np.asarray, (robots, given))
    assert got.joint_forces.dtype == np.float32
    with jax.enable_x64(True):
        want = slips(*jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float64), given))
    found = worst(got, want, size=length)
    assert found["forces"] < 1e-4, found
    assert found["crank_acceleration"] < 2e-4, found
    assert found["foot_acceleration"] < 1e-4, found


@pytest.mark.parametrize(("solver", "bound"), [("lu", 4500), ("scaled", 1000), ("block", 600)])
def test_condition_numbers_stay_small_over_the_turn(solver, bound, float64):
    """Measured over 90 angles: 2.9e3 in SI units, 7.0e2 scaled, 5.5e2 for a leg by itself."""
    angles = jnp.linspace(0, 2 * np.pi, 64)
    of = partial(condition_number, system="forward_slip", solver=solver, mu_kinetic=0.5)
    found = jax.jit(jax.vmap(of, in_axes=(None, 0)))(default_params(), angles)
    assert float(jnp.min(found)) > 10
    assert float(jnp.max(found)) < bound


def test_a_linkage_that_cannot_close_spoils_its_own_numbers_only(float64):
    robots, given = default_robots(), random_instants()
    short = replace(robots, rocker=robots.rocker.at[7].multiply(0.5))
    given |= {"theta": given["theta"].at[7].set(0.0)}
    got, want = slips(short, given), slips(robots, given)
    spoilt = np.abs(np.asarray(got.joint_forces[7]))
    assert not np.all(spoilt < 1e9)  # infinite, no number, or absurd: the loop's links are in line
    others = np.arange(COUNT) != 7
    np.testing.assert_allclose(got.joint_forces[others], want.joint_forces[others], rtol=1e-9)
