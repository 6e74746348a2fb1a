"""Methods find what they find whatever the objective's unit, and what it is at the start."""

from __future__ import annotations

import numpy as np
import pytest

from stickslip.optim import FunctionProblem, OptimStatus, solve

LOW, HIGH = np.full(2, -2.0), np.full(2, 2.0)


def line(unit, x, draw):
    """Least -0.5, on the limit; 0 in the middle."""
    return unit * (x[0] + x[1]), x[0] + x[1] + 0.5


def bowl(unit, x, draw):
    """Least 0.1875 at (0.375, 0.125), on the limit; value and slope 0 in the middle."""
    return unit * (x[0] ** 2 + 3 * x[1] ** 2), x[0] + x[1] - 0.5


def raised(unit, x, draw):
    """Least 0.125 above a million, on the limit."""
    return unit * (1e6 + (x[0] - 1) ** 2 + (x[1] - 1) ** 2), 1.5 - x[0] - x[1]


@pytest.fixture(params=["gradient", "cma"])
def method(request) -> str:
    if request.param == "cma":
        pytest.importorskip("cma")
    return request.param


@pytest.mark.parametrize("start", [None, [1e-7, 0.0]], ids=["zero", "tiny"])
@pytest.mark.parametrize(
    ("function", "least"), [(line, -0.5), (bowl, 0.1875), (raised, 1e6 + 0.125)]
)
def test_the_optimum_is_found_in_any_unit_from_any_value(method, function, least, start):
    for unit in (1e-9, 1e9):
        found = solve(FunctionProblem(function, unit, LOW, HIGH), method, start=start)
        assert found.status is OptimStatus.FEASIBLE
        assert found.value / unit == pytest.approx(least, rel=1e-12, abs=2e-6)
