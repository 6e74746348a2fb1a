"""The chapter's pointwise search does what it says, and claims no more."""

import numpy as np
import pytest

from stickslip.optim import CRITERIA, OptimStatus
from stickslip.optim.posture.graph.grid import build_grid
from tests.optim.posture.helpers import on_grid as solve
from tests.optim.posture.helpers import over_bump, tiny


@pytest.fixture(scope="module")
def grid():
    return build_grid(over_bump(), 5, method="test", progress=False)


@pytest.mark.parametrize("name", CRITERIA)
def test_each_choice_is_the_best_at_its_waypoint(grid, name: str):
    found = solve(over_bump(name), "grid", angles=5)
    at, before = grid.stations, 0.0
    wheels = ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    costs = {
        "grip": -np.min([0.8 * N - np.abs(F) for F, N in wheels], axis=0),
        "normal_force": -np.min([N for _, N in wheels], axis=0),
        "friction_demand": np.max([np.abs(F) / N for F, N in wheels], axis=0),
    }
    for k in range(10):
        M = at.torque[k]
        cost = costs[name][k] if name in costs else np.abs(M)
        cost = np.abs(M - before) if name == "torque_variation" else cost
        best = np.min(cost[grid.admissible(k)])
        chosen = np.all(at.leg_angles[k] == found.leg_angles[k], axis=-1)
        assert np.sum(chosen) == 1
        np.testing.assert_allclose(cost[chosen], best, rtol=1e-12)
        before = M[chosen]


@pytest.mark.parametrize("name", [n for n, c in CRITERIA.items() if c.kind == "max"])
def test_for_worst_stations_its_bound_is_below_every_path(name: str):
    limited = over_bump(name, leg_rate=0.9)
    found = solve(limited, "grid", angles=5)
    path = solve(limited, "dp", angles=5)
    assert found.details["grid_bound"] <= path.value
    free = solve(over_bump(name, leg_rate=None), "grid", angles=5)
    np.testing.assert_allclose(free.value, free.details["grid_bound"], rtol=1e-9)
    exact = solve(over_bump(name, leg_rate=None), "dp", angles=5)
    np.testing.assert_allclose(exact.value, free.value, rtol=1e-9)


def test_sums_have_no_bound_and_what_breaks_the_rate_is_said_to():
    found = solve(over_bump(leg_rate=0.9), "grid", angles=5)
    assert found.status is OptimStatus.VIOLATED
    assert found.details["grid_bound"] is None
    assert not found.feasible
    assert {name for name, by in found.residuals.items() if by > 0} == {"leg_rate"}


def test_within_the_rate_it_is_feasible_and_no_better_than_the_best_path():
    problem = over_bump(leg_rate=0.9)
    found = solve(problem, "grid", angles=5, within_rate=True)
    assert found.status is OptimStatus.FEASIBLE
    assert found.feasible
    assert found.value >= solve(problem, "dp", angles=5).value - 1e-9


def test_a_dead_end_is_no_proof_that_there_is_no_path():
    problem = over_bump(leg_rate=0.9, end_angles=(0.6, 2.5))
    found = solve(problem, "grid", angles=5, within_rate=True)
    assert found.status is OptimStatus.FAILED
    assert "dead end: leg_rate = 0.9" in found.message
    assert solve(problem, "dp", angles=5).status is OptimStatus.FEASIBLE


def test_a_waypoint_without_any_pair_is_named():
    found = solve(tiny(min_clearance=3.0), "grid", angles=3)
    assert found.status is OptimStatus.FAILED
    assert "at waypoint 0 (x = 3.3 m) no pair of angles meets clearance" in found.message


def test_stations_in_chunks_are_the_stations_at_once(monkeypatch, grid):
    monkeypatch.setattr("stickslip.optim.posture.graph.grid.CHUNK", 80)  # 3 waypoints of 25 pairs
    chunked = build_grid(over_bump(), 5, method="test", progress=False)
    for one, other in zip(chunked.stations, grid.stations, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-9)
