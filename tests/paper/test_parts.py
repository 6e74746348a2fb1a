"""The parts of the figures: peaks, slides, names, tables."""

import numpy as np
import pytest

from stickslip.paper.registry import FIGURES, figures_of
from stickslip.paper.result import Claim, Setting
from stickslip.paper.text import claims_text, csv_text
from stickslip.paper.torque import peak_of
from stickslip.paper.walks import Slide


def test_a_peak_between_samples_is_found_to_third_order():
    errors = []
    for count in (40, 80):
        x = np.linspace(0, 1, count + 1)
        place, value = peak_of(np.cos(x - 0.333) + 0.1 * (x - 0.333) ** 3)
        assert value == pytest.approx(1, abs=1e-6)
        errors.append(abs(place - 0.333))
    assert errors[1] < errors[0] / 3.5
    assert peak_of(np.array([3.0, 2.0, 1.0])) == (0.0, 3.0)


def test_a_slide_belongs_to_the_step_whose_exchange_starts_it():
    early, late = Slide(0.9999999999, 1.2, 1e-3), Slide(1.4, 2.1, 1e-3)
    assert (early.step, early.onset) == (1, 0.0)
    assert (late.step, late.onset, late.stop) == (1, pytest.approx(0.4), pytest.approx(1.1))


def test_names_come_in_the_chapters_order_and_all_means_all():
    assert list(figures_of(["fig19", "fig11", "fig19"])) == ["fig11", "fig19"]
    assert list(figures_of(["all"])) == list(figures_of(["fig12", "all"])) == list(FIGURES)
    with pytest.raises(ValueError, match=r"'fig1'.*accepted: fig11, .*scheme, all"):
        figures_of(["fig1"])


def test_cells_hold_numbers_to_ten_digits_words_and_nothing_for_nan():
    text = csv_text({"a [m]": np.array([1 / 3, np.nan]), "b": ["x, y", "z"]})
    assert text == 'a [m],b\n0.3333333333,"x, y"\n,z\n'
    with pytest.raises(ValueError, match=r"zip\(\) argument 2"):
        csv_text({"a": [1], "b": []})


def test_bars_in_a_claim_do_not_break_the_table():
    claim = Claim("|f| <= N", "1", "agrees", "because")
    assert claims_text({"fig1": [claim]}).splitlines()[-1].count("|") == 6
    with pytest.raises(ValueError, match="verdict = 'maybe'; accepted: agrees"):
        Claim("a", "b", "maybe", "c")
    with pytest.raises(ValueError, match="samples = 1"):
        Setting(1)
