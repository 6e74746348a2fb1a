"""Dynamic programming finds the best path of all, and says why where there is none."""

import re
from dataclasses import replace
from itertools import product

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams, pose
from stickslip.optim import CRITERIA, Evaluation, OptimStatus, PostureProblem, Station
from stickslip.optim.posture.criteria import steps
from stickslip.optim.posture.evaluate import below
from stickslip.optim.posture.problem import refined
from tests.optim.posture.helpers import HIGH, LOW, over_bump, plain_cost, tiny
from tests.optim.posture.helpers import on_grid as solve

THREE = np.linspace(LOW, HIGH, 3)
ENDS = {"start_angles": (1.3, 1.9), "end_angles": (1.7, 1.6)}
FAR = {"start_angles": (1.25, 1.25), "end_angles": (2.6, 2.6)}


def every_path(problem: PostureProblem) -> tuple[np.ndarray, Station]:
    """All paths over three angles a leg that meet every constraint: [P, K, 2], and stations."""
    K = len(problem.x)
    layers = [list(product(THREE, THREE))] * K
    if problem.start_angles is not None:
        layers = [[problem.start_angles], *layers[1:-1], [problem.end_angles]]
    paths = np.array(list(product(*(range(len(layer)) for layer in layers))))
    angles = np.stack([np.array(layer)[paths[:, k]] for k, layer in enumerate(layers)], 1)
    # The stations of each pair at each waypoint, one drive for each pair of the grid.
    drives = [problem.stations(np.ravel([of[i % len(of)] for of in layers])) for i in range(9)]
    at = Station(
        *(np.stack([np.stack([getattr(d, name)[k] for d in drives])[paths[:, k]]
                    for k in range(K)], 1) for name in Station._fields)
    )  # fmt: skip
    good = np.all((at.grip >= 0) & (at.N_rear >= 0) & (at.N_front >= 0), axis=1)
    good &= np.all(at.clearance >= problem.min_clearance, axis=1)
    rear, front = np.moveaxis(0.35 * np.exp(1j * angles), -1, 0)
    good &= np.all(abs(0.83 - front - rear.conj()) >= 0.56 + problem.min_wheel_clearance, axis=1)
    if problem.leg_rate is not None:
        moves = np.abs(np.diff(angles, axis=1)) / np.diff(problem.x)[:, None]
        good &= np.all(moves <= problem.leg_rate + 1e-9, axis=(1, 2))
    return angles[good], Station(*(of[good] for of in at))


@pytest.mark.long
@pytest.mark.parametrize("ends", [{}, ENDS], ids=["free", "fixed"])
@pytest.mark.parametrize("leg_rate", [None, 3.0])
def test_no_path_of_all_is_better(leg_rate, ends):
    problem = tiny(leg_rate=leg_rate, **ends)
    angles, at = every_path(problem)
    assert 0 < len(angles) < 9 ** (2 if ends else 4)  # some break a constraint
    for name in CRITERIA:
        found = solve(replace(problem, criterion=name), "dp", angles=3)
        costs = plain_cost(name, at, problem.friction)
        assert found.status is OptimStatus.FEASIBLE
        np.testing.assert_allclose(found.value, np.min(costs), rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.details["grid_bound"], found.value, rtol=1e-9)
        assert np.min(np.abs(angles - found.leg_angles).max((1, 2))) < 1e-12


def test_the_rate_limit_costs_something_here():
    """So that the tests with and without it test something."""
    problems = [tiny("torque_variation", leg_rate=rate) for rate in (None, 3.0, 2.0)]
    values = [solve(problem, "dp", angles=3).value for problem in problems]
    assert values[0] < values[1] < values[2]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"min_grip": 5000.0}, r"at waypoint 0 \(x = 3.3 m\) .*grip rules out 9 of 9"),
        ({"params": UGVParams(wheel_gap=1.0)}, "wheels rules out 9 of 9"),
        (
            {"friction": 0.12, "min_clearance": 0.45},
            "at waypoint 0 .*clearance rules out 6 of 9, grip rules out 8 of 9",
        ),
        ({"friction": 2.0, "leg_rate": 1.0} | FAR, "leg_rate = 1.0 .* In 3 of 3 steps no leg"),
        ({"friction": 2.0, "leg_rate": 1.9} | FAR, "leg_rate = 1.9 rad/m lets none of the"),
    ],
)
def test_a_grid_without_a_path_names_the_constraint_and_proves_nothing(fields, message: str):
    found = solve(replace(tiny(leg_rate=None), **fields), "dp", angles=3)
    assert found.status is OptimStatus.FAILED
    assert found.x is None
    assert found.value == np.inf
    assert not found.feasible
    assert re.search(message, found.message), found.message


def test_a_given_pair_that_breaks_a_constraint_is_infeasible_and_one_within_tolerance_is_not():
    problem = tiny(start_angles=(1.3, 1.9), friction=2.0)
    clearance = problem.stations(solve(problem, "dp", angles=3).x).clearance[0]
    for by, status in ((5e-7, OptimStatus.FEASIBLE), (5e-6, OptimStatus.INFEASIBLE)):
        found = solve(replace(problem, min_clearance=clearance + 0.35 * by), "dp", angles=3)
        assert found.status is status
    assert found.message.startswith("infeasible: at waypoint 0")


def test_a_grid_too_coarse_for_any_move_says_so():
    found = solve(over_bump(leg_rate=0.2), "dp", angles=3)
    assert "In 9 of 9 steps no leg can move on the grid" in found.message
    assert np.ptp(found.leg_angles, axis=0).max() == 0


def test_a_legs_range_of_one_angle_needs_no_choice():
    fixed = replace(over_bump().params, leg_angle_min=1.5, leg_angle_max=1.5)
    found = solve(replace(over_bump(), params=fixed), "dp", angles=3)
    assert found.status is OptimStatus.FEASIBLE
    np.testing.assert_array_equal(found.x, 1.5)
    assert not found.message.startswith("In ")


def test_the_bound_is_the_grids_and_says_so():
    found = solve(over_bump(leg_rate=0.9), "dp", angles=5)
    assert found.message == (
        "proved: the best of all paths over the 5 x 5 grid of leg angles, not of all drives"
    )
    assert found.value * (1 - 1e-9) <= found.details["grid_bound"] <= found.value


def test_a_value_that_the_objective_contradicts_is_no_proof(monkeypatch):
    monkeypatch.setattr(PostureProblem, "evaluate", lambda self, x: Evaluation(1.0, x, True))
    found = solve(tiny(), "dp", angles=3)
    assert found.status is OptimStatus.INACCURATE
    assert "grid_bound" not in found.details


@pytest.mark.parametrize("name", CRITERIA)
def test_a_proved_bound_is_lowered_by_more_than_rounding(name: str):
    problem = tiny(name)
    for value in (-250.0, 0.0, 1e-3, 4e5):
        assert below(problem, value) < value
        assert 4e-13 * abs(value) <= value - below(problem, value) <= 1e-9 * (1 + abs(value))


def test_what_dynamic_programming_cannot_do_is_refused():
    for angles in (1, 2.5, (3, 3, 3), True, (3, 1), "31", (5, np.array([0.6, 1.0]))):
        with pytest.raises(ValueError, match=r"angles = .*an integer >= 2"):
            solve(tiny(), "dp", angles=angles)


@pytest.mark.long
def test_a_free_split_grips_where_equal_torques_slip_and_does_the_same_work():
    free = over_bump("total_energy", friction=0.105, leg_rate=0.2, free_split=True)
    assert solve(replace(free, free_split=False), "dp", angles=9).x is None
    fine, x = refined(free, solve(free, "dp", angles=9).x, 200)
    at, params = fine.stations(x), free.params
    assert min(np.min(at.grip), np.max(np.abs(np.diff(at.torque))) - 5.0) > 0.0
    with jax.enable_x64(True):
        works = np.asarray(free.criterion.terms(*steps(at)))
        ends = pose(params, free.track.astype(float), at.x[[0, -1]], at.leg_angles[[0, -1]])
        gained = float(np.diff(ends.potential_energy(params))[0])
    assert np.sum(works) == pytest.approx(gained, abs=1e-6 * np.sum(np.abs(works)))
