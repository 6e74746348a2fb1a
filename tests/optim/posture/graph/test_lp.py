"""The flow finds dp's value, and its dual proves it whatever the solver says."""

import cvxpy as cp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.optim import OptimStatus
from stickslip.optim.posture.graph.grid import build_grid
from stickslip.optim.posture.graph.lp import build_graph, proved_bound
from tests.optim.posture.helpers import on_grid as solve
from tests.optim.posture.helpers import over_bump, tiny

ENDS = {"start_angles": (1.3, 1.9), "end_angles": (1.7, 1.6)}


@pytest.mark.parametrize("name", ["total_energy", "torque_variation", "peak_torque"])
def test_value_is_dps_and_the_bound_proves_it(name: str):
    problem = over_bump(name, leg_rate=0.9)
    path, flow = (solve(problem, method, angles=5) for method in ("dp", "lp"))
    assert flow.status is OptimStatus.FEASIBLE
    assert flow.feasible
    np.testing.assert_allclose(flow.value, path.value, rtol=1e-9)
    assert flow.details["grid_bound"] <= path.value
    np.testing.assert_allclose(flow.details["grid_bound"], path.value, rtol=1e-7)
    assert flow.message == path.message


@pytest.fixture(scope="module")
def graph():
    grid = build_grid(over_bump(leg_rate=0.9), 5, method="test", progress=False)
    return build_graph(grid, None, 0.0)


@pytest.fixture(scope="module")
def best() -> float:
    return solve(over_bump(leg_rate=0.9), "dp", angles=5).value


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0, 1e4))
@settings(max_examples=30)
def test_any_potentials_give_a_bound(graph, best: float, seed: int, size: float):
    """So no error of a solver makes a bound that is none."""
    potentials = size * np.random.default_rng(seed).standard_normal(graph.source + 2)
    assert proved_bound(graph, potentials) <= best


def test_the_graph_holds_the_moves_that_the_rate_allows_and_no_others(graph):
    grid = build_grid(over_bump(leg_rate=0.9), 5, method="test", progress=False)
    pairs = np.stack(np.meshgrid(grid.rear, grid.front, indexing="ij"), -1).reshape(-1, 2)
    ends = np.append(graph.begins[1:], len(graph.tail))
    for k in range(9):
        near = np.max(np.abs(pairs[:, None] - pairs), axis=-1) <= 0.9 * 0.6 + 1e-9
        near &= grid.layers[k].admissible[:, None] & grid.layers[k + 1].admissible
        edges = slice(graph.begins[k + 1], ends[k + 1])
        there = set(zip(graph.tail[edges] - 25 * k, graph.head[edges] - 25 * (k + 1), strict=True))
        assert there == set(zip(*np.nonzero(near), strict=True))


def test_an_inaccurate_solution_is_not_passed_off_as_optimal(monkeypatch):
    monkeypatch.setattr(cp.Problem, "status", property(lambda self: cp.OPTIMAL_INACCURATE))
    found = solve(tiny(), "lp", angles=3)
    assert found.status is OptimStatus.INACCURATE
    assert "optimal_inaccurate" in found.message


def test_a_bound_that_does_not_reach_the_value_is_no_proof(monkeypatch):
    monkeypatch.setattr("stickslip.optim.posture.graph.lp.proved_bound", lambda graph, y: 1.0)
    found = solve(tiny(), "lp", angles=3)
    assert found.status is OptimStatus.INACCURATE
    assert found.details["grid_bound"] == pytest.approx(1.0)
    worst = solve(tiny("grip"), "lp", angles=3)
    assert worst.status is OptimStatus.FEASIBLE  # of its 0/1 costs, 1 is proof enough
