"""The grid holds the stations and moves that it should; the chapter's choice point by point."""

import numpy as np
import pytest

from stickslip.optim import OptimStatus, solve
from stickslip.optim.posture.grid import _arrive, build_grid
from tests.optim.posture.helpers import over_bump
from tests.trees import assert_same


@pytest.fixture(scope="module")
def grid():
    return build_grid(over_bump(), 5, 2)


def test_stations_in_chunks_are_the_stations_at_once(monkeypatch, grid):
    monkeypatch.setattr("stickslip.optim.posture.layers.CHUNK", 80)  # 3 waypoints of 25 pairs
    for one, other in zip(build_grid(over_bump(), 5, 2).layers, grid.layers, strict=True):
        assert_same(one.stations, other.stations, rtol=1e-12, atol=1e-9)


def test_the_graph_holds_the_moves_that_the_rate_allows_and_no_others():
    grid = build_grid(over_bump(leg_rate=0.9), 5, 2)
    pairs = np.stack(np.meshgrid(grid.rear, grid.front, indexing="ij"), -1).reshape(-1, 2)
    near = np.max(np.abs(pairs[:, None] - pairs), axis=-1) <= 0.9 * 0.6 + 1e-9
    for k in range(9):
        good = near & grid.layers[k].admissible[:, None] & grid.layers[k + 1].admissible
        for tail in np.flatnonzero(grid.layers[k].admissible):  # from which nodes it leads on
            before = np.where(np.arange(25) == tail, 0.0, np.inf)
            cost, came, count = _arrive(grid, k, before)
            np.testing.assert_array_equal(np.isfinite(cost), good[tail])
            assert np.all(came[good[tail]] == tail)
            assert count == np.sum(good)


@pytest.mark.parametrize("name", ["wheel_energy", "torque_variation", "grip"])
def test_each_choice_is_the_best_at_its_waypoint(grid, name: str):
    found = solve(over_bump(name), "grid", angles=5)
    before = 0.0
    for k, layer in enumerate(grid.layers):
        at = layer.stations
        M, wheels = at.torque, ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
        cost = np.abs(M - before if name == "torque_variation" else M)
        if name == "grip":
            cost = -np.min([0.8 * N - np.abs(F) for F, N in wheels], axis=0)
        best = np.min(cost[layer.admissible])
        chosen = np.all(at.leg_angles == found.leg_angles[k], axis=-1)
        assert np.sum(chosen) == 1
        np.testing.assert_allclose(cost[chosen], best, rtol=1e-12)
        before = M[chosen]


@pytest.mark.parametrize("name", ["peak_torque", "friction_demand"])
def test_for_worst_stations_its_bound_is_below_every_path(name: str):
    limited = over_bump(name, leg_rate=0.9)
    found = solve(limited, "grid", angles=5)
    assert found.details["grid_bound"] <= solve(limited, "dp", angles=5, polish=False).value
    free = solve(over_bump(name, leg_rate=None), "grid", angles=5)
    np.testing.assert_allclose(free.value, free.details["grid_bound"], rtol=1e-9)
    exact = solve(over_bump(name, leg_rate=None), "dp", angles=5, polish=False)
    np.testing.assert_allclose(exact.value, free.value, rtol=1e-9)


def test_sums_have_no_bound_and_what_breaks_the_rate_is_said_to():
    found = solve(over_bump(leg_rate=0.9), "grid", angles=5)
    assert found.status is OptimStatus.VIOLATED
    assert found.details["grid_bound"] is None
    assert not found.feasible
    assert {name for name, by in found.residuals.items() if by > 0} == {"leg_rate"}
