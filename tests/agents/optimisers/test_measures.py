"""Measures against what can be worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.agents.optimisers.report import closeness_table, ecdf, ert, gaps, hits
from tests.agents.optimisers.table import NAME, run


def test_hits_are_the_first_time_a_gap_is_reached():
    one = run([(3, 1.0), (10, 0.05), (40, 0.001)], 100)
    assert gaps(one) == pytest.approx([1.0, 0.05, 0.001, 0.001])
    found = hits(one, np.array([2.0, 0.1, 0.05000001, 0.002, 1e-6]), "evaluations")
    assert found.tolist() == [3, 10, 10, 40, np.inf]
    assert hits(one, np.array([0.1]), "seconds") == [1.0]
    assert hits(run([], 50), np.array([10.0]), "evaluations") == [np.inf]


def test_expected_running_time_counts_what_failures_spent():
    runs = [run([(10, 0.005)], 90, seed=0), run([(30, 0.005)], 90, seed=1), run([], 100, seed=2)]
    found = ert(runs, 0.01)
    assert (found.value, found.successes, found.runs) == ((10 + 30 + 100) / 2, 2, 3)
    assert found.low == pytest.approx(10)  # draws of the first run alone: 1 of 27
    assert found.high == np.inf  # of the last alone: as often
    assert ert(runs, 0.001).value == np.inf
    assert ert([run([(20, 0.0)], 50)], 0.01, "seconds")[:3] == (2.0, 2.0, 2.0)


def test_a_distribution_rises_to_the_share_of_pairs_that_are_hit():
    runs = [run([(16, 0.05)], 100), run([(160, 0.5)], 200, seed=1)]
    at, share = ecdf(runs, "evaluations", np.array([1.0, 0.1]))
    assert at.tolist() == [1, 1, 10]  # by 16 free numbers
    assert share == pytest.approx([0.25, 0.5, 0.75])
    assert [len(part) for part in ecdf([], "seconds")] == [0, 0]


def test_a_gap_to_what_nobody_knows_is_not_shown():
    known = run([(3, 0.5)], 9)
    unknown = replace(known, instance=f"{NAME}-s1000000")
    assert closeness_table([unknown]).rows == [["mine", ""]]
    assert closeness_table([known, unknown]).rows == [["mine", "0.5 (0%)"]]
