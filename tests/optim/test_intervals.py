"""Intervals hold what exact arithmetic gives, whatever is computed."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.optim.intervals import Interval, Jet, hull, interval

NUMBERS = st.floats(-1e6, 1e6, allow_nan=False).filter(lambda x: x == 0 or abs(x) > 1e-100)
SHARE = st.floats(0, 1)


def interval_of(a: float, b: float) -> Interval:
    return Interval(np.float64(min(a, b)), np.float64(max(a, b)))


def inside(x: Interval, share: float) -> float:
    return float(min(max(x.lo + share * (x.hi - x.lo), x.lo), x.hi))


def holds(found: Interval, exact: Fraction) -> bool:
    return Fraction(float(found.lo)) <= exact <= Fraction(float(found.hi))


@given(NUMBERS, NUMBERS, NUMBERS, NUMBERS, SHARE, SHARE)
def test_arithmetic_holds_the_exact_result(a, b, c, d, s, t):
    x, y = interval_of(a, b), interval_of(c, d)
    u, v = inside(x, s), inside(y, t)
    p, q = Fraction(u), Fraction(v)
    assert holds(x + y, p + q)
    assert holds(x - y, p - q)
    assert holds(x * y, p * q)
    assert holds(x * v, p * q)
    assert holds(x.square(), p * p)
    assert holds(2.0 - x, 2 - p)
    assert holds(hull(x, y), p)
    if y.lo > 0 or y.hi < 0:
        assert holds(x / y, p / q)
    root = abs(x.lo) + x - x  # not below 0 but for what it forgot
    assert holds(root, Fraction(abs(float(x.lo))))


@given(NUMBERS, st.floats(0, 20), SHARE)
def test_elementary_functions_hold_their_values_and_turning_points(a, width, share):
    x = interval_of(a, a + width)
    u = inside(x, share)
    for name, function in (("sin", np.sin), ("cos", np.cos), ("arctan", np.arctan)):
        found = getattr(x, name)()
        assert found.holds(function(u))
        if name != "arctan" and width >= 2 * np.pi:
            assert (found.lo, found.hi) == (-1, 1)
    small = x * 1e-5
    assert small.exp().holds(np.exp(inside(small, share)))
    assert interval_of(a * a, a * a + width).sqrt().holds(abs(a))


def test_functions_of_thin_intervals_stay_thin():
    x = interval(np.random.default_rng(0).uniform(0.1, 3, 1000))
    for found in (x.sin(), x.cos(), x.exp(), x.sqrt(), x.arctan(), x * x, 1.0 / x):
        assert np.max(found.hi - found.lo) < 1e-13


def test_what_has_no_value_is_everything():
    assert (1.0 / interval_of(-1.0, 2.0)).lo == -np.inf
    assert interval_of(-1.0, 4.0).sqrt().lo == -np.inf


ENDS = st.one_of(NUMBERS, st.sampled_from([-np.inf, np.inf, -1e308, 1e308, 1e-308, 0.0]))


@given(ENDS, ENDS, ENDS, ENDS, NUMBERS, NUMBERS)
def test_infinite_ends_never_end_in_no_number(a, b, c, d, u, v):
    """What u and v would give is held still, u lying in the one interval and v in the other."""
    x = hull(interval_of(a, b), interval(u))
    y = hull(interval_of(c, d), interval(v))
    p, q = Fraction(u), Fraction(v)
    found = [(x + y, p + q), (x - y, p - q), (x * y, p * q), (x * v, p * q), (x.square(), p * p)]
    found += [(y.reciprocal(), 1 / q)] if v else []
    for got, exact in found:
        assert float(got.lo) <= exact <= float(got.hi)
    for got in (x.sin(), x.cos(), x.exp(), x.arctan(), y.sqrt(), y.reciprocal()):
        assert got.lo <= got.hi
    assert np.isfinite(x.middle) or not np.isfinite([x.lo, x.hi]).all()
    assert not np.isnan([x.middle, x.radius]).any()
    for name in ("sin", "cos", "arctan"):
        assert getattr(x, name)().holds(getattr(np, name)(u))


@pytest.mark.parametrize("x", [0.3, 1.2, 2.0])
def test_jets_hold_derivatives_over_a_box(x: float):
    """sqrt(x^2 + y) sin(x) / (1 + atan(x y)), its derivatives along x and along y."""

    def function(x, y):
        root = (x * x + y).sqrt() if isinstance(x, Jet) else np.sqrt(x * x + y)
        sine, angle = (
            (x.sin(), (x * y).arctan()) if isinstance(x, Jet) else (np.sin(x), np.arctan(x * y))
        )
        return root * sine / (angle + 1.0)

    y, half, h = 0.7, 0.01, 1e-4
    zero, one = interval(np.zeros((2, 1))), np.ones(1)
    jets = [
        Jet(
            Interval(of - half * one, of + half * one),
            interval(np.stack([one * (1 - k), one * k])),
            zero,
        )
        for k, of in enumerate((x, y))
    ]
    found = function(*jets)
    for a, b in np.array([x, y]) + np.random.default_rng(0).uniform(-half, half, (50, 2)):
        assert found.value.holds(function(a, b)).all()
        for k, (da, db) in enumerate(((h, 0.0), (0.0, h))):
            up, down = function(a + da, b + db), function(a - da, b - db)
            middle = function(a, b)
            assert found.first[k].holds((up - down) / (2 * h)).all()
            assert found.second[k].holds((up - 2 * middle + down) / h**2).all()
    assert np.max(found.second.hi - found.second.lo) < 1.0  # and say something
