"""What `recommend` promises of the UGV's settings follows from its sample and holds on others."""

import jax
import numpy as np
import pytest
from scipy import stats

from benchmarks.report import MARKS, RESULTS, read_json
from benchmarks.ugv import __main__ as command
from benchmarks.ugv import poses
from stickslip.dynamics.ugv.recommendation import NEAR, promises
from tests.documents import ROOT

FRESH = 100
"""A seed of the tests' own."""
RARE = 1e-4
"""Probability of the most that is left to chance."""


@pytest.fixture(scope="module")
def content():
    return read_json(ROOT / RESULTS / "ugv.json")


def test_a_promise_is_the_bound_of_the_worse_half_s_order():
    n = 10_000
    off = np.arange(n, dtype=float)[::-1] + 1
    flags = np.zeros(n, bool)
    held = poses.Differences(off + 30, off, flags)
    row = poses.promised(poses.Differences(off, 2 * off, flags), held)
    place = int(stats.binom.ppf(poses.CONFIDENCE, n, poses.QUANTILE))
    assert row["torque"] == [np.median(off), place + 1, n]
    assert row["contact"] == [2 * np.median(off), 2 * (place + 1), 2 * n]
    assert row["held_out_over"] == n - (place + 1) + 30
    assert row["wrong"] == row["held_out_wrong"] == 0


def test_module_and_table_are_those_of_the_results(content):
    module = (ROOT / command.DATA).read_text(encoding="utf-8")
    page = (ROOT / command.DOCUMENT).read_text(encoding="utf-8")
    assert module == command.source(content)
    assert f"{MARKS[0]}\n{command.table(content)}\n{MARKS[1]}" in page
    quick = {part: content["parts"][part]["quick"] for part in command.PARTS}
    assert quick == dict.fromkeys(("promise", "costs"), False)


def test_every_setting_that_is_recommended_had_no_wrong_status(content):
    rows = content["promise"]
    wrong = {(r["ground"], r["place"], r["solver"], r["dtype"]): r["wrong"] for r in rows}
    assert any(wrong.values())
    chosen = command.recommended(content)
    assert len(list(promises())) == sum(len(point["costs"]) for point in chosen)
    for point in chosen:
        own = point["ground"]
        for ground in tuple(poses.AS_FUNCTION) if own == "function" else (own,):
            assert wrong[ground, point["place"], point["solver"], point["dtype"]] == 0


def test_promises_hold_on_the_poses_held_out(content):
    kept = [row for row in content["promise"] if row["wrong"] == 0]
    assert {(row["ground"], row["place"]) for row in kept} == {
        (ground, place) for ground in poses.CLASSES for place in poses.PLACES
    }
    for row in kept:
        assert min(row["poses"], row["held_out"]) > 15_000
        # Torque and contact each may exceed their own bound.
        most = int(stats.binom.ppf(1 - RARE, row["held_out"], 1 - poses.QUANTILE))
        assert row["held_out_over"] <= 2 * most
        assert row["held_out_wrong"] <= 3


@pytest.mark.parametrize("ground", poses.CLASSES)
def test_the_population_is_what_it_is_said_to_be(ground, float64):
    count = 256
    for place, (low, high) in poses.PLACES.items():
        one, other = (poses.draw(ground, place, count, seed) for seed in (FRESH, poses.HELD_OUT))
        one.params.validate()
        r = one.params.wheel_radius
        assert np.all(np.diff(np.sort(one.x / r)) > 0)
        assert np.all(np.abs(one.x / r) <= high + 150)  # beside the feature it belongs to
        assert np.median(np.abs(one.x / r)) > low
        assert not np.any(one.x == other.x)
        np.testing.assert_array_equal(poses.draw(ground, place, count, FRESH).angles, one.angles)
        slope = jax.vmap(lambda s, x: s.profile(x)[1])(one.shape, np.asarray(one.x))
        assert np.max(np.abs(slope)) <= 1.6 * poses.STEEPEST  # waves may add up
        assert np.mean(np.abs(slope) > 0.1) > 0.2
    assert poses.PLACES["near"][1] == NEAR
