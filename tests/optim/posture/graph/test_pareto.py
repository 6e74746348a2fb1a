"""Fronts are those of all paths on a small grid, counted out one by one."""

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise, product

import numpy as np
import pytest

from stickslip.optim import PostureProblem, criterion_by_name
from stickslip.optim.posture.graph.pareto import pareto_front
from tests.optim.posture.helpers import plain_cost, tiny

ANGLES = 3
PAIRS = (
    ("wheel_energy", "torque_variation"),
    ("wheel_energy", "peak_torque"),
    ("grip", "total_energy"),
    ("friction_demand", "normal_force"),
)


def problem() -> PostureProblem:
    return replace(tiny(), friction=0.3)


@lru_cache
def all_paths() -> tuple[np.ndarray, ...]:
    """Every feasible path of the grid: [B, 2K], and its stations' numbers [B, K]."""
    given = problem()
    low, high = (side[0] for side in given.bounds)
    pairs = list(product(np.linspace(low, high, ANGLES), repeat=2))
    at = [given.stations(np.tile(pair, len(given.x))) for pair in pairs]
    good = [
        [n for n in range(len(pairs)) if at[n].status[k] == 0 and at[n].clearance[k] >= 0.1]
        for k in range(len(given.x))
    ]
    limits = given.leg_rate * np.diff(given.x) * (1 + 1e-9)
    paths = [
        path
        for path in product(*good)
        if all(
            np.max(np.abs(np.subtract(pairs[a], pairs[b]))) <= limits[k]
            for k, (a, b) in enumerate(pairwise(path))
        )
    ]
    index = np.array(paths)
    K = np.arange(len(given.x))
    fields = [np.stack([of[i] for of in at])[index, K] for i in range(len(at[0]))]
    return np.array(pairs)[index].reshape(len(paths), -1), type(at[0])(*fields)


@lru_cache
def all_values(first: str, second: str) -> np.ndarray:
    """The two criteria of every feasible path [B, 2], by the plain formulas."""
    stations = all_paths()[1]
    return np.stack([plain_cost(name, stations, 0.3) for name in (first, second)], -1)


def beaten(values: np.ndarray, point: np.ndarray) -> bool:
    """Whether some path is as good as the point in both and better in one."""
    slack = 1e-9 * np.abs(point)
    return bool(np.any(np.all(values <= point + slack, 1) & np.any(values < point - slack, 1)))


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_every_point_is_a_feasible_path_that_none_beats(first, second):
    front = pareto_front(problem(), first, second, points=6, angles=ANGLES)
    assert front.criteria == (first, second)
    assert len(front.values) == len(front.x) >= 1
    everything = all_values(first, second)
    for values, x in zip(front.values, front.x, strict=True):
        assert problem().is_feasible(x)
        for name, value in zip((first, second), values, strict=True):
            one = replace(problem(), criterion=criterion_by_name(name))
            np.testing.assert_allclose(one.objective(x), value, rtol=1e-9)
        assert not beaten(everything, values)
    assert np.all(np.diff(front.values[:, 0]) > 0)
    assert np.all(np.diff(front.values[:, 1]) < 0)


@pytest.mark.long
@pytest.mark.parametrize(("first", "second"), PAIRS[1:])
def test_a_complete_front_with_a_worst_station_is_the_whole_front(first, second):
    front = pareto_front(problem(), first, second, points=400, angles=ANGLES)
    everything = all_values(first, second)
    whole = np.array([values for values in everything if not beaten(everything, values)])
    whole = whole[np.argsort(whole[:, 0])]
    different = np.any(np.abs(np.diff(whole, axis=0)) > 1e-9 * np.abs(whole[1:]), axis=1)
    whole = whole[np.concatenate([[True], different])]
    assert front.complete
    np.testing.assert_allclose(front.values, whole, rtol=1e-9)


def test_a_front_of_sums_has_all_corners_of_the_hull_when_complete():
    first, second = PAIRS[0]
    front = pareto_front(problem(), first, second, points=50, angles=ANGLES)
    assert front.complete
    everything = all_values(first, second)
    for share in np.linspace(0.001, 0.999, 101):
        size = np.ptp(everything, axis=0)
        weights = np.array([share, 1 - share]) / size
        least = np.min(everything @ weights)
        np.testing.assert_allclose(np.min(front.values @ weights), least, rtol=1e-9)


def test_bad_options_are_refused_by_name():
    for bad in (
        {"first": "speed"},
        {"points": 1},
        {"first": criterion_by_name("grip"), "angles": 1},
    ):
        options = {"first": "grip", "second": "peak_torque"} | bad
        with pytest.raises(ValueError, match="accepted"):
            pareto_front(problem(), **options)
