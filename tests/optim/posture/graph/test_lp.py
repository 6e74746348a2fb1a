"""The flow finds dp's value, and its dual proves it whatever the solver says."""

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.optim import OptimStatus
from stickslip.optim.posture.graph.grid import build_grid
from stickslip.optim.posture.graph.lp import Edges, edges_of
from tests.optim.posture.helpers import on_grid as solve
from tests.optim.posture.helpers import over_bump, tiny


@pytest.mark.parametrize("name", ["total_energy", "torque_variation"])
def test_value_is_dps_and_the_bound_proves_it(name: str):
    problem = over_bump(name, leg_rate=0.9)
    path, flow = (solve(problem, method, angles=5) for method in ("dp", "lp"))
    assert flow.status is OptimStatus.FEASIBLE
    assert flow.feasible
    np.testing.assert_allclose(flow.value, path.value, rtol=1e-9)
    for found in (path, flow):
        assert found.details["grid_bound"] <= path.value
        np.testing.assert_allclose(found.details["grid_bound"], path.value, rtol=1e-7)
    assert flow.message == path.message
    assert flow.details["edges"] == path.details["edges"] > 0


def test_a_worst_station_is_refused():
    with pytest.raises(ValueError, match="grip holds a worst station"):
        solve(tiny("grip"), "lp")


@pytest.fixture(scope="module")
def grid():
    return build_grid(over_bump(leg_rate=0.9), 5, 2, "test", False)


@pytest.fixture(scope="module")
def edges(grid) -> Edges:
    return edges_of(grid)


@pytest.fixture(scope="module")
def best() -> float:
    return solve(over_bump(leg_rate=0.9), "dp", angles=5).value


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0, 1e4))
@settings(max_examples=30)
def test_any_potentials_give_a_bound(edges, best: float, seed: int, size: float):
    """So no error of a solver makes a bound that is none."""
    potentials = size * np.random.default_rng(seed).standard_normal(8 * 25)
    assert edges.bound(potentials) <= best


def test_the_graph_holds_the_moves_that_the_rate_allows_and_no_others(grid, edges):
    pairs = np.stack(np.meshgrid(grid.rear, grid.front, indexing="ij"), -1).reshape(-1, 2)
    ends = np.append(edges.begins[1:], len(edges.tail))
    for k in range(9):
        near = np.max(np.abs(pairs[:, None] - pairs), axis=-1) <= 0.9 * 0.6 + 1e-9
        near &= grid.layers[k].admissible[:, None] & grid.layers[k + 1].admissible
        step = slice(edges.begins[k], ends[k])
        there = set(zip(edges.tail[step] - 25 * k, edges.head[step] - 25 * (k + 1), strict=True))
        assert there == set(zip(*np.nonzero(near), strict=True))


def test_an_inaccurate_solution_is_not_passed_off_as_optimal(monkeypatch):
    monkeypatch.setattr(cp.Problem, "status", property(lambda self: cp.OPTIMAL_INACCURATE))
    found = solve(tiny(), "lp", angles=3)
    assert found.status is OptimStatus.INACCURATE
    assert "optimal_inaccurate" in found.message


def test_a_bound_that_does_not_reach_the_value_is_no_proof(monkeypatch):
    monkeypatch.setattr(Edges, "bound", lambda edges, y: 1.0)
    found = solve(tiny(), "lp", angles=3)
    assert found.status is OptimStatus.INACCURATE
    assert found.details["grid_bound"] == pytest.approx(1.0)
