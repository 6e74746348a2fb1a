"""Axes and designs: which values, which points, what is refused."""

import numpy as np
import pytest

from stickslip.agents import Axis
from stickslip.agents.sweeps.axes import Design


def test_texts_are_the_axes_that_they_say():
    assert Axis.of("0:1:5").values == (0, 0.25, 0.5, 0.75, 1)
    assert np.allclose(Axis.of("1:100:3:log").values, [1, 10, 100])
    assert Axis.of("0.3,0.1").values == (0.3, 0.1)
    assert Axis.of("2").values == Axis.of(2).values == (2,)
    assert (Axis.of("1:9:latin:log").ends, Axis.of("0:1:sobol").random) == ((1, 9), True)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0:1", "is no axis"),
        ("wet,firm", "'wet' in 'wet,firm' is no number"),
        ("1:0:5", "accepted: finite LOW < HIGH"),
        ("0:1:1", "2 values or more"),
        ("0:inf:5", "finite LOW < HIGH"),
        ("0:1:5:log", "LOW > 0 with log"),
        ("1,1", "each value once"),
    ],
)
def test_ranges_that_are_none_are_refused_by_name(text: str, said: str):
    with pytest.raises(ValueError, match="axis mu: ") as refused:
        Design.of({"mu": text}, None, 0)
    assert said in str(refused.value)


def test_points_are_the_product_of_the_axes_with_the_samples_beside_it():
    made = Design.of({"a": "0:1:3", "x": "0:1:sobol", "b": [5, 7], "y": "2:4:latin"}, 8, 3)
    assert made.dims == {"a": 3, "b": 2, "sample": 8}
    points = made.at(np.arange(made.points))
    assert {len(one) for one in points.values()} == {48}
    assert points["a"].tolist() == np.repeat([0, 0.5, 1], 16).tolist()
    assert points["b"].tolist() == np.tile(np.repeat([5, 7], 8), 3).tolist()
    assert np.array_equal(points["x"], np.tile(made.drawn["x"], 6))
    some = made.at(np.arange(17, 23))
    assert all(np.array_equal(some[name], points[name][17:23]) for name in points)


def test_random_axes_fill_their_range_evenly_and_again_from_the_seed():
    made = Design.of({"x": "0:1:sobol", "y": "1:100:latin:log"}, 64, 1)
    assert np.all(np.histogram(made.drawn["x"], 16, (0, 1))[0] == 4)
    assert np.all(np.histogram(np.log10(made.drawn["y"]), 64, (0, 2))[0] == 1)
    again = Design.of({"x": "0:1:sobol", "y": "1:100:latin:log"}, 64, 1)
    other = Design.of({"x": "0:1:sobol", "y": "1:100:latin:log"}, 64, 2)
    assert again.describe() == made.describe() != other.describe()


@pytest.mark.parametrize(
    ("axes", "samples", "said"),
    [
        ({"x": "0:1:sobol"}, None, "samples = None; accepted: a number"),
        ({"x": "0:1:3"}, 8, "samples = 8; accepted: a number"),
        ({"x": "0:1:sobol"}, 0, "samples = 0"),
        ({"x": object()}, None, "not a number"),
    ],
)
def test_designs_that_are_none_are_refused(axes, samples, said: str):
    with pytest.raises(ValueError, match=said):
        Design.of(axes, samples, 0)
