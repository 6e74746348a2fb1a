"""Axes and designs: which values, which points, what is refused."""

import numpy as np
import pytest

from stickslip.agents.sweeps.swept import axes_of, axis_values, values_at


def test_texts_are_the_axes_that_they_say():
    assert axis_values("0:1:5") == (0, 0.25, 0.5, 0.75, 1)
    assert np.allclose(axis_values("1:100:3:log"), [1, 10, 100])
    assert axis_values("0.3,0.1") == (0.3, 0.1)
    assert axis_values("2") == axis_values(2) == (2,)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0:1", "is no axis"),
        ("wet,firm", "'wet' in 'wet,firm' is no number"),
        ("1:0:5", "accepted: finite LOW < HIGH"),
        ("0:1:1", "2 to 1,000,000 values"),
        ("0:1:100000000", "2 to 1,000,000 values"),
        ("0:inf:5", "finite LOW < HIGH"),
        ("0:1:5:log", "LOW > 0 with log"),
        ("1,1", "each value once"),
        (object(), "not a number"),
    ],
)
def test_ranges_that_are_none_are_refused_by_name(text: str, said: str):
    with pytest.raises(ValueError, match="axis mu: ") as refused:
        axes_of({"mu": text})
    assert said in str(refused.value)


def test_points_are_the_product_of_the_axes_the_last_one_fastest():
    axes = axes_of({"a": "0:1:3", "b": [5, 7]})
    points = values_at(axes, np.arange(6))
    assert points["a"].tolist() == np.repeat([0, 0.5, 1], 2).tolist()
    assert points["b"].tolist() == np.tile([5, 7], 3).tolist()
    some = values_at(axes, np.arange(2, 5))
    assert all(np.array_equal(some[name], points[name][2:5]) for name in points)
    assert values_at({}, np.arange(1)) == {}
