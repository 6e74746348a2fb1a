"""The instances: enough of them, what they say of themselves, and what is known of each."""

import re

import numpy as np
import pytest

from benchmarks.suite import verified
from stickslip.optim import FAMILIES, instance, suite
from stickslip.optim.instances.instance import parts_of

CHEAP = {"ugv-bump-energy-d8-v2", "gait-time-d16-v2", "gait-friction-d32-v2"}


def test_there_are_enough_of_every_family_under_ids_that_say_what_they_are():
    everything = suite()
    assert len(everything) >= 48
    for one in everything.values():
        assert re.fullmatch(r"[a-z0-9-]+-d\d+-v\d+", one.id)
        assert f"-d{one.n}-" in one.id
    assert {one.family for one in everything.values()} == set(FAMILIES)
    assert sum(len(suite(family)) for family in FAMILIES) == len(everything)


def test_an_unknown_one_brings_the_nearest():
    with pytest.raises(ValueError, match="ugv-bump-energy-d64-v2"):
        instance("ugv-bump-energie-d64-v2")
    with pytest.raises(ValueError, match="posture"):
        suite("postures")


def test_all_have_a_best_known_point_and_those_with_a_bound_none_below_it():
    for one in suite().values():
        known = one.known
        assert known is not None, one.id
        assert known.how
        if len(one.goals) == 1:
            assert known.x.shape == (one.n,)
            assert np.isfinite(known.value)
        else:
            assert known.front.shape == (len(known.x), len(one.goals))
        if known.bound is not None:
            assert known.value >= known.bound


@pytest.mark.parametrize(
    "name",
    [
        *sorted(CHEAP),
        *(pytest.param(one, marks=pytest.mark.long) for one in sorted(set(suite()) - CHEAP)),
    ],
)
def test_what_is_recorded_comes_out_again(name):
    one = instance(name)
    assert one.problem.free.n == one.n
    assert verified(one) == "as recorded"


def test_a_changed_instance_is_not_the_recorded_one(monkeypatch):
    one = instance("gait-time-d16-v2")
    other = instance("gait-time-d64-v2")
    assert one.digest() != other.digest()
    monkeypatch.setitem(one.__dict__, "problems", other.problems)
    assert "another instance than the recorded one" in verified(one)


def test_a_digest_is_of_numbers_to_seven_digits_and_of_all_fields():
    x = np.array([1.0, 1e-3])
    assert parts_of(x) == parts_of(x * (1 + 1e-12))
    assert parts_of(x) != parts_of(x * (1 + 1e-5))
    assert parts_of({"a": 1, "b": (None, "c")}) != parts_of({"a": 1, "b": (None, "d")})
    with pytest.raises(TypeError, match="no digest"):
        parts_of(object())
