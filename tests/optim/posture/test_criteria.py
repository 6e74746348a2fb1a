"""The criteria are what they say, and their parts add up to them."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from stickslip.dynamics.ugv import PoseSolver, UGVParams, place
from stickslip.optim import CRITERIA, Criterion, PostureProblem, Station, station
from stickslip.optim.posture.criteria import increase, station_cost, steps
from tests.optim.posture.helpers import TRACK, over_bump, plain_cost, random_x


@pytest.mark.parametrize("name", CRITERIA)
def test_value_is_the_criterion_written_out_in_loops(name: str):
    problem = over_bump(name)
    for seed in range(3):
        x = random_x(problem, seed)
        plain = plain_cost(name, problem.stations(x), 0.8)
        np.testing.assert_allclose(problem.objective(x), plain, rtol=1e-12)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("wheel", ["rear", "front"])
def test_the_worst_is_seen_at_either_wheel_and_either_way(wheel: str, way: float):
    """Forces by hand: on a drive the other wheel, or the other way, may always be worse."""
    other = {"rear": "front", "front": "rear"}[wheel]
    forces = {f"F_{wheel}": 300.0 * way, f"N_{wheel}": 500.0}
    forces |= {f"F_{other}": 90.0, f"N_{other}": 900.0}
    nothing = dict.fromkeys(Station._fields, 0.0)
    at = Station(**nothing | forces | {"torque": 7.0 * way, "friction": 0.5})
    at = at.map(jnp.asarray)
    worst = {name: float(jnp.max(CRITERIA[name].terms(at))) for name in WORST}
    assert worst == pytest.approx(WORST)


WORST = {"friction_demand": 0.6, "grip": 50.0, "normal_force": -500.0, "peak_torque": 7.0}


@pytest.mark.parametrize("criterion", CRITERIA.values(), ids=CRITERIA)
def test_increases_along_a_drive_add_up_to_the_value(criterion: Criterion):
    """What an environment that pays the increases pays in all."""
    problem = over_bump(criterion)
    found = problem.stations(x := random_x(problem))
    with jax.enable_x64(True):
        paid = jnp.zeros(())
        for k in range(1, len(problem.x)):
            a, b = (Station(*(of[i] for of in found)) for i in (k - 1, k))
            paid += increase(criterion, paid, a, b, k == 1)
    np.testing.assert_allclose(paid, problem.objective(x), rtol=1e-12)


def test_with_moving_legs_wheels_and_legs_together_lift_the_vehicle():
    """And no less than the lift is ever put in, which is not so of the wheels alone."""
    phase = np.linspace(0, 2 * np.pi, FINE)
    angles = np.pi / 2 + 0.3 * np.stack([np.sin(phase), np.cos(2 * phase)], -1)
    posture = PostureProblem(UGVParams(), TRACK, X, "total_energy").posture
    with jax.enable_x64(True):
        potential, terms = map(np.asarray, _drive(posture, jnp.asarray(angles)))
    wheels, legs = terms[:, 0], terms[:, 1:]
    both = wheels + np.sum(legs, -1)
    np.testing.assert_allclose(both, potential[1:] - potential[:-1], atol=5e-3)
    assert np.max(np.abs(legs)) > 1
    positive = np.sum(np.maximum(wheels, 0)) + np.sum(np.maximum(legs, 0))
    assert positive >= np.max(potential) - potential[0] - 1e-2


FINE = 257
X = np.linspace(2.5, 5.5, FINE)


@jax.jit
def _drive(posture, angles):
    """Potential energy, and the work of wheels and legs in each step [J]."""
    placed = place(posture.params, posture.odometer.track, posture.x, angles, PoseSolver(samples=0))
    terms = posture.criterion.terms(*steps(posture.stations(angles)))
    return placed.potential_energy(posture.params), terms


def test_a_wheel_that_carries_nothing_demands_much_friction_and_never_less_than_none():
    found = over_bump().stations(random_x(over_bump()))
    lifted = found._replace(N_rear=-found.N_rear)
    with jax.enable_x64(True):
        demand = np.asarray(station_cost(CRITERIA["friction_demand"], lifted))
    assert np.all(np.isfinite(demand))
    assert np.all(demand >= 0)


def test_stations_follow_the_dtype_of_what_they_are_given(dtype):
    posture = over_bump().posture
    cast = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), posture)
    found = jax.jit(lambda of, angles: station(
        of.solver, of.params, of.odometer, of.x, angles, of.friction
    ))(cast, jnp.full((len(posture.x), 2), 1.5, dtype))  # fmt: skip
    assert {of.dtype for of in found[:-1]} == {dtype}
    wide = over_bump().stations(np.full(over_bump().n, 1.5))
    scale = 1e-3 if dtype == jnp.float32 else 1e-12
    np.testing.assert_allclose(found.N_rear, wide.N_rear, rtol=scale)
