"""dp's costs of arriving prove its value over the grid, whoever made them."""

import numpy as np
import pytest

from stickslip.optim import CRITERIA, OptimStatus
from stickslip.optim.posture.graph.grid import build_grid
from stickslip.optim.posture.graph.lp import build_graph
from stickslip.optim.posture.graph.search import best_paths, certify
from stickslip.optim.posture.result import below
from tests.optim.posture.helpers import on_grid as solve
from tests.optim.posture.helpers import over_bump, tiny

ENDS = {"start_angles": (1.3, 1.9), "end_angles": (1.7, 1.6)}


def grid_of(problem, angles=5):
    return build_grid(problem, angles, method="test", progress=False)


@pytest.mark.parametrize("name", ["wheel_energy", "grip"])
def test_costs_of_arriving_prove_the_value(name: str):
    grid = grid_of(over_bump(name, leg_rate=0.9))
    paths = best_paths(grid)
    value = float(np.min(paths.values[-1]))
    proof = certify(grid, paths.values)
    assert value - 1e-9 * (1 + abs(value)) <= proof.bound <= value
    assert proof.missed <= 1e-9 * (1 + abs(value))


@pytest.mark.parametrize("name", CRITERIA)
def test_a_proved_bound_is_lowered_by_more_than_rounding(name: str):
    problem = tiny(name)
    for value in (-250.0, 0.0, 1e-3, 4e5):
        assert below(problem, value) < value
        assert value - below(problem, value) >= 4e-13 * abs(value)
        assert value - below(problem, value) <= 1e-9 * (1 + abs(value))


@pytest.mark.parametrize("name", ["wheel_energy", "peak_torque"])
def test_every_edge_of_the_linear_program_is_looked_at(name: str):
    for problem in (over_bump(name, leg_rate=0.9), tiny(name, leg_rate=None, **ENDS)):
        grid = grid_of(problem, 3)
        graph = build_graph(grid, None if name == "wheel_energy" else 0.0, 0.0)
        ends = sum(int(np.sum(grid.layers[k].admissible)) for k in (0, -1))
        assert certify(grid, best_paths(grid).values).edges == len(graph.tail) - ends


@pytest.mark.parametrize("name", ["wheel_energy", "grip"])
def test_any_potentials_give_a_bound_and_wrong_ones_a_worse_one(name: str):
    grid = grid_of(over_bump(name, leg_rate=0.9))
    right = best_paths(grid).values
    value = float(np.min(right[-1]))
    random = np.random.default_rng(0)
    for size in (1e-6, 1.0, 1e3):
        wrong = [of + size * random.standard_normal(of.shape) for of in right]
        proof = certify(grid, wrong)
        assert proof.bound < value
        assert proof.missed > 0
    higher = [of + 7.0 * (k == len(right) - 1) for k, of in enumerate(right)]
    assert certify(grid, higher).bound <= value  # an end that costs more than it does


def test_potentials_without_an_answer_prove_nothing():
    grid = grid_of(over_bump(leg_rate=0.9))
    values = [of.copy() for of in best_paths(grid).values]
    values[3][np.isfinite(values[3])] = np.nan
    assert certify(grid, values).bound == -np.inf
    unreached = [of.copy() for of in best_paths(grid).values]
    unreached[4][:] = np.inf  # claims that no path comes so far
    assert certify(grid, unreached).bound == -np.inf


def test_the_result_says_that_it_is_the_grids(monkeypatch):
    found = solve(over_bump(leg_rate=0.9), "dp", angles=5)
    assert found.status is OptimStatus.FEASIBLE
    assert found.message == (
        "proved: the best of all paths over the 5 x 5 grid of leg angles, not of all drives"
    )
    assert found.details["certificate"]["edges"] > 0
    monkeypatch.setattr(
        "stickslip.optim.posture.graph.search.certify",
        lambda grid, values: certify(grid, [np.zeros_like(of) for of in values]),
    )
    found = solve(over_bump(leg_rate=0.9), "dp", angles=5)
    assert found.status is OptimStatus.INACCURATE
    assert found.details["grid_bound"] < 0.5 * found.value
