"""Numbers come out of a page as they went in, to the resolution that is promised."""

import json

import numpy as np
import pytest

from stickslip.envs.rendering.html.encode import LEVELS, decoded, encoded, plain, script_text


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e9])
def test_no_number_moves_by_more_than_half_a_level(scale: float):
    values = scale * np.random.default_rng(1).normal(size=(301, 3))
    back = decoded(json.loads(json.dumps(encoded(values))))
    room = np.ptp(values) / LEVELS / 2
    assert back.shape == values.shape
    assert np.abs(back - values).max() <= room * (1 + 1e-6)
    assert np.abs(back - values).max() > room / 10  # it does round


@pytest.mark.parametrize(
    "values", [np.arange(-3, 70), np.array([True, False]), np.array([7.25] * 4), np.zeros(0)]
)
def test_whole_numbers_truth_and_constants_are_exact(values: np.ndarray):
    np.testing.assert_array_equal(decoded(encoded(values)), values.astype(float))


def test_single_precision_is_kept_to_the_bit():
    values = np.random.default_rng(2).normal(size=(50, 2)).astype(np.float32) + 1e4
    back = decoded(encoded(values))
    assert back.dtype == np.float32
    np.testing.assert_array_equal(back, values)


def test_what_is_not_finite_is_none_and_leaves_the_others_alone():
    values = np.array([np.nan, 1.0, np.inf, 2.0, -np.inf])
    np.testing.assert_allclose(decoded(encoded(values)), [np.nan, 1, np.nan, 2, np.nan], rtol=1e-4)
    assert np.isnan(decoded(encoded(np.full(3, np.nan)))).all()
    assert plain(float("inf")) is None


def test_text_for_a_script_cannot_end_it():
    text = script_text({"name": "</script><!-- & \u2028"})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"name": "</script><!-- & \u2028"}
