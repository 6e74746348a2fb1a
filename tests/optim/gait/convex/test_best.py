"""The best gaits: known values, hand-solvable cases, a peer, the order of the grid, proofs."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams, kinematics
from stickslip.dynamics.biped.inertia import body_masses
from stickslip.optim import GaitProblem, OptimStatus, solve
from stickslip.optim.gait.convex.certificate import Lagrangian, Polygons, least
from stickslip.optim.gait.convex.grid_problem import Sample
from stickslip.optim.gait.gait import Polynomials
from tests.optim.gait.helpers import LIMIT, periodic, quickest_on_a_lattice, robot, solved, transfer

FASTEST = {0.02: 5.7, 0.2: 10.0}
"""Mean crank rate without slip [rad/s], by friction, at 4 N m, of dynamic programming."""


@pytest.mark.parametrize("mu", FASTEST)
def test_the_fastest_gait_is_as_fast_as_dynamic_programming_had_it(mu: float):
    found = solved(mu=mu, steps=100)
    assert found.status is OptimStatus.OPTIMAL
    assert np.pi / found.value == pytest.approx(FASTEST[mu], abs=0.06)
    assert np.pi / found.held_value < np.pi / found.every_bound
    assert found.best.friction_use <= mu * (1 + 1e-6)
    assert np.max(np.abs(found.torque)) <= LIMIT * (1 + 1e-6)


@pytest.mark.parametrize(
    ("limits", "rate"), [({"max_power": 0.2}, 0.0739), ({"max_torque_rate": 1.0}, 0.006)]
)
def test_a_weak_motor_is_no_slower_than_at_a_constant_rate(limits, rate):
    problem = periodic(mu=0.06, steps=60, **limits)
    steady = np.zeros(problem.n)
    steady[0] = rate**2
    slowest, found = problem.evaluate(steady), solve(problem, certify="grid")
    assert slowest.feasible
    assert found.feasible
    assert found.value < slowest.value / 2


def test_a_mark_just_behind_a_foothold_is_passed():
    for distance in (0.2401, 0.2405, 0.0003):
        assert 0.01 <= GaitProblem.transfer(robot(), None, distance=distance).end_phase < 0.02


def test_the_quickest_start_is_that_of_a_lattice_of_phases_and_rates():
    problem = transfer(1, mu=0.15, start_rate=4.0, steps=80)
    found = solve(problem)
    lattice = quickest_on_a_lattice(problem)
    assert found.every_bound < lattice * (1 + 2e-3)
    assert found.value == pytest.approx(lattice, rel=2e-2)


def test_the_grid_is_of_second_order():
    coarse, fine = (solved("energy", steps=k, mean_rate=6.0, mu=0.1) for k in (30, 120))
    assert coarse.discretisation > 4**1.6 * fine.discretisation > 0
    for of_bound, of_value in ((coarse, fine), (fine, coarse)):
        assert of_bound.every_bound <= of_value.held_value
    assert abs(coarse.value - fine.value) < 0.02 * fine.value


def test_with_a_strong_motor_no_friction_is_needed_at_constant_speed_of_the_centre_of_mass():
    found = solved("friction", torque_limit=60.0, mean_rate=3.0, steps=100)
    assert found.value < 1e-4
    momentum = found.gait.nodes.P * found.gait.crank_rate
    assert np.ptp(momentum) < 5e-3 * np.mean(momentum)


def test_where_the_floor_holds_a_gait_may_be_ballistic_and_keeps_its_energy():
    found = solved("work", mean_rate=5.0, steps=100)
    assert found.value < 3e-3 < 0.01 * solved("work", mu=0.06, mean_rate=5.0, steps=100).value
    gait = found.gait
    height = _potential_energy(gait.theta[0])
    energy = gait.nodes.M[0] * gait.b[0] / 2 + height
    assert np.ptp(energy) < 1e-2 * np.ptp(height)


def test_the_motors_work_is_the_change_of_energy():
    gait = solve(transfer(1, "energy", mu=0.3, end_rate=3.0, steps=80)).best
    torque = Polynomials(gait.profiles.samples.torque(*gait.samples))
    share, weight = np.polynomial.legendre.leggauss(8)
    work = np.sum(torque((share + 1) / 2) * weight / 2 * gait.grid.h[..., None])
    ends = gait.nodes.M[0, [0, -1]] * gait.b[0, [0, -1]] / 2
    ends = ends + _potential_energy(gait.theta[0, [0, -1]])
    assert work == pytest.approx(ends[1] - ends[0], rel=1e-6)


def _potential_energy(theta: np.ndarray) -> np.ndarray:
    """From the heights of the 24 bodies [J]."""
    with jax.enable_x64(True):
        wide = robot().astype(np.float64)
        heights = jax.jit(jax.vmap(lambda angle: kinematics(wide, angle).centres[:, 1]))
        found = np.asarray(heights(np.asarray(theta))) @ np.asarray(body_masses(wide))
        return found * float(np.asarray(wide.gravity))


def test_no_gait_of_another_objective_beats_what_is_proved():
    options = {"mu": 0.06, "mean_rate": 4.0, "steps": 60}
    names = ("time", "torque", "work", "energy")
    found = {name: solved(name, **options) for name in names}
    for name, best in found.items():
        assert best.status is OptimStatus.OPTIMAL, best.message
        assert 0 <= best.certificate.violation < 1e-8
        assert best.certificate.sign > -1e-8
        assert best.certificate.complementarity < 1e-6
        assert -1e-7 * best.value <= best.certificate.gap < 1e-6 * max(best.value, 0.1)
        assert best.lower_bound <= best.value
        for other in found.values():
            problem = periodic(name, **options)
            assert problem.objective(other.x) >= best.lower_bound * (1 - 1e-7)
            assert problem.evaluate_gait(other.gait).feasible


@pytest.mark.parametrize(
    ("given", "options"),
    [
        ({"crank_length": 0.3, "hip_mass": 70.0}, {"torque_limit": 900.0, "mean_rate": 1.0}),
        ({"bar_density": 1e-4, "hip_mass": 1e-4, "foot_mass": 1e-4, "foot_inertia": 1e-9},
         {"torque_limit": 2e-3, "mean_rate": 3.0}),
    ],
)  # fmt: skip
def test_other_robots_loads_and_gravities_are_proved_optimal_too(given: dict, options: dict):
    problem = GaitProblem.periodic(robot(**given), "energy", mu=0.1, steps=60, **options)
    found = solve(problem)
    assert found.status is OptimStatus.OPTIMAL, found.message
    assert found.held is not None
    assert found.every_bound <= found.held_value
    assert found.mean_rate >= options["mean_rate"] * (1 - 1e-6)


def test_friction_may_differ_from_step_to_step():
    by_step = solve(transfer(3, mu=[0.3, 0.02, 0.3], steps=40))
    use = np.abs(by_step.gait.friction_force / by_step.gait.normal_force).max(axis=1)
    assert use[1] <= 0.02 * (1 + 1e-6) < use[0]


def test_a_walk_stops_where_it_is_told_to_and_goes_on_at_the_rate_it_is_told_to():
    stopped = solve(transfer(2, mu=0.2, end_rate=0.0, steps=40))
    assert stopped.status is OptimStatus.OPTIMAL
    assert stopped.crank_rate[0, 0] == 0.0
    assert stopped.crank_rate[-1, -1] < 1e-4
    steady = solved("energy", mu=0.2, mean_rate=3.0, steps=60)
    onto = steady.crank_rate[0, 0]
    joined = solve(transfer(2, "energy", mu=0.2, end_rate=onto, mean_rate=1.5, steps=40))
    assert joined.crank_rate[-1, -1] == pytest.approx(onto, rel=1e-9)


def test_the_zero_moment_point_stays_inside_the_foot_where_it_is_asked_to():
    params = BipedParams.from_bars(heel=6.0, toe=6.5)
    options = {"mu": 0.2, "torque_limit": LIMIT, "steps": 60}
    free = solve(GaitProblem.periodic(params, **options))
    kept = solve(GaitProblem.periodic(params, zmp=True, **options))
    heel, toe = kept.gait.nodes.robot.heel, kept.gait.nodes.robot.toe
    assert np.max(free.best.zmp) > toe or np.min(free.best.zmp) < -heel
    assert -heel * (1 + 1e-6) <= np.min(kept.best.zmp)
    assert np.max(kept.best.zmp) <= toe * (1 + 1e-6)
    assert kept.value > free.value


def test_proofs_of_the_grid_alone_are_those_of_the_grid():
    problem = periodic("friction", steps=16, mean_rate=4.0)
    whole, grid = solve(problem), solve(problem, certify="grid")
    assert grid.evaluations < whole.evaluations
    assert (grid.value, grid.lower_bound) == (whole.value, whole.lower_bound)
    assert grid.status is whole.status
    assert grid.held is None
    assert grid.every_bound is None
    assert whole.every_bound is not None
    with pytest.raises(ValueError, match=r"certify = 'all' is unknown; accepted: 'every', 'grid'"):
        solve(problem, certify="all")


@pytest.mark.long
def test_nothing_on_a_fine_lattice_is_below_the_least_and_something_is_near_it():
    rng = np.random.default_rng(7)
    m = 40
    A = np.stack([np.ones(m), -np.ones(m), rng.normal(size=m), rng.normal(size=m)])
    B = np.stack([np.zeros(m), np.zeros(m), rng.normal(size=m), rng.normal(size=m)])
    C = np.stack([np.full(m, 2.0), np.full(m, 2.0), np.full(m, 1.5), np.full(m, 2.5)])
    one, none = np.ones(m), np.zeros(m)
    ends = (np.full(m, 0.01), np.full(m, 3.0))
    polygons = Polygons.of(Sample(A, B, C, (one, none, none), ends, one))
    parts = {name: rng.uniform(0, 1, m) * (rng.uniform(size=m) < 0.6)
             for name in ("inverse", "heat", "work", "root")}  # fmt: skip
    form = Lagrangian(**parts, on_T=rng.normal(size=m), on_b=rng.normal(size=m), rest=none)
    found = least(polygons, form)
    T, b = np.meshgrid(np.linspace(-2, 2, 401), np.linspace(0.01, 3, 400), indexing="ij")
    for i in range(m):
        fits = np.all(A[:, i, None, None] * T + B[:, i, None, None] * b <= C[:, i, None, None], 0)
        rate = np.sqrt(b)
        value = form.inverse[i] / rate + form.heat[i] * T**2 / rate
        value += form.work[i] * np.maximum(T, 0) - form.root[i] * rate
        value += form.on_T[i] * T + form.on_b[i] * b
        lattice = np.min(np.where(fits, value, np.inf))
        assert found[i] <= lattice + 1e-8
        assert lattice - found[i] < 0.05
