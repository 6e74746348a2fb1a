"""No drive goes below its bound, wherever its angles lie, and the bound is near the best."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.optim import CRITERIA, OptimStatus, solve
from stickslip.optim.posture.bounds.branch import bound_every_drive
from stickslip.optim.posture.bounds.sweep import BESIDE, bottleneck, lossy
from stickslip.optim.problem import OptimStatus as Status
from tests.optim.posture.bounds.helpers import better, drives, over, sample

MANY = 2048


# A worst station now; the others are long.
NAMES = ["peak_torque"]
NAMES += [pytest.param(n, marks=pytest.mark.long) for n in CRITERIA if n not in NAMES]


@pytest.fixture(scope="module")
def searched():
    """Of each kind of problem: random drives, and what a search from them found."""
    return {}


def values(problem, searched, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Feasible drives and their values: random ones, and the best of a search."""
    if name not in searched:
        x = drives(problem, MANY)
        searched[name] = np.concatenate([x, better(problem, x[:256])])
    x = searched[name]
    x = x[np.arange(MANY + 256) % len(x)]
    value, short = sample(problem, x)
    good = (short <= 0) & np.isfinite(value)
    return x[good], value[good]


@pytest.mark.parametrize("name", NAMES)
def test_no_drive_is_below_the_bound(searched, name: str):
    problem = over(name, "short")
    x, value = values(problem, searched, f"short {name}")
    assert len(value) > 500
    best = x[np.argmin(value)]
    found = bound_every_drive(problem, best, cells=16, most_corners=12_000, tolerance=0.0)
    assert found.best == pytest.approx(np.min(value), rel=1e-9)
    assert found.value <= np.min(value)
    bounds = [level["bound"] for level in found.levels]
    assert len(bounds) > 1
    assert bounds == sorted(bounds)
    assert found.gap < (1.1 if name == "torque_variation" else 0.3)


@pytest.mark.long
@pytest.mark.parametrize("kind", ["usual", "slippery"])
@pytest.mark.parametrize("name", ["wheel_energy", "peak_torque"])
def test_nor_on_other_floors_and_with_free_or_given_ends(searched, name: str, kind: str):
    problem = over(name, kind)
    x, value = values(problem, searched, f"{kind} {name}")
    assert len(value) > 20
    free = bound_every_drive(replace(problem, start_angles=None), cells=12, most_corners=1)
    alone = bound_every_drive(problem, cells=12, most_corners=1)
    known = bound_every_drive(problem, x[np.argmin(value)], cells=12, most_corners=1)
    ended = replace(problem, end_angles=tuple(x[np.argmin(value)][-2:]))
    last = bound_every_drive(ended, cells=12, most_corners=1)
    assert free.value <= alone.value + 1e-6 * abs(alone.value)
    assert max(alone.value, known.value, last.value) <= np.min(value)
    assert last.value >= alone.value - 1e-6 * abs(alone.value)


def test_what_was_ruled_out_is_infeasible_everywhere():
    stuck = over("wheel_energy", "slippery", min_grip=2000.0)
    x = drives(stuck, MANY)
    value, short = sample(stuck, np.concatenate([x, x[:256]]))
    assert not np.any((short <= 0) & np.isfinite(value))
    assert bound_every_drive(stuck, cells=12).value == np.inf
    answer = solve(stuck, "branch", start=x[0], cells=12)
    assert answer.status in (Status.VIOLATED, Status.INFEASIBLE)


@pytest.mark.long
def test_the_method_says_how_good_its_drive_is(searched):
    problem = over("wheel_energy", "short")
    x, value = values(problem, searched, "short wheel_energy")
    best = x[np.argmin(value)]
    found = solve(problem, "branch", start=best, cells=20, tolerance=0.5, most_corners=1)
    assert found.lower_bound <= found.value
    assert found.status is OptimStatus.OPTIMAL  # within half of it, which was asked for
    strict = solve(problem, "branch", start=best, cells=20, tolerance=0.0, most_corners=1)
    assert strict.status is OptimStatus.FEASIBLE
    assert 0 < strict.details["gap"] < 0.5


def test_bad_options_are_refused():
    problem = over()
    for name, bad in (("tolerance", -1), ("cells", 1), ("most_corners", 0), ("cells", 10**7)):
        with pytest.raises(ValueError, match=name):
            bound_every_drive(problem, **{name: bad})
    with pytest.raises(ValueError, match=r"criterion = mine; accepted: .*worst stations"):
        bound_every_drive(over(replace(CRITERIA["wheel_energy"], name="mine")))


@pytest.mark.parametrize("count", [2, 3, 4, 2 * BESIDE, 2 * BESIDE + 1, 30])
def test_waypoints_are_halved_where_the_bound_loses_and_four_beside(count: int):
    at = count // 3
    places = np.arange(count)
    costs = np.where(places == at, 1.0, 0.0)
    assert bottleneck(costs, 1.0).tolist() == (np.abs(places - at) <= BESIDE).tolist()
    go = np.where(places <= at, 1.0, 0.0)  # all is paid between at and the next one
    near = (places >= at - BESIDE) & (places <= at + 1 + BESIDE)
    assert lossy(np.zeros(count), go).tolist() == near.tolist()
