"""The instances: enough of them, what they say of themselves, and what is known of each."""

import json
import pickle
import re
from dataclasses import replace

import jax
import numpy as np
import pytest

from stickslip.dynamics.ugv import UGVParams, equilibrium, ground_forces
from stickslip.optim import FAMILIES, PostureProblem, instance, suite
from stickslip.optim.instances.instance import VALUES, parts_of
from stickslip.optim.instances.ugv import STATIONS, split_problem, track_named, vehicle_design

SAME = 1e-6
"""Relative tolerance of a recorded value: roundings of another machine."""
SEEDED = {name for name in json.loads(VALUES.read_text())["instances"] if "-s" in name[-4:]}
CHEAP_SEEDED = {f"{name}-s1" for name in ("ugv-bump-energy-d8-v2", "gait-time-d16-v2")}
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
    known = one.known
    assert one.digest() == known.digest
    values, feasible = zip(*map(one.value, np.atleast_2d(known.x)), strict=True)
    assert all(feasible)
    wanted = known.value if known.front is None else known.front
    np.testing.assert_allclose(values, wanted, rtol=SAME, atol=SAME)


@pytest.mark.parametrize(
    "name",
    [
        *sorted(CHEAP_SEEDED),
        *(pytest.param(one, marks=pytest.mark.long) for one in sorted(SEEDED - CHEAP_SEEDED)),
    ],
)
def test_a_seeded_instance_is_as_recorded_and_not_solved_where_searches_start(name):
    one = instance(name)
    assert one.digest() == one.known.digest
    value, feasible = one.value(one.known.x)
    assert feasible
    assert value[0] == pytest.approx(one.known.value, rel=SAME, abs=SAME)
    value, feasible = one.value(one.objective().middle)
    assert not feasible or value[0] - one.known.value > 0.01 * abs(one.known.value)


def test_a_seed_draws_another_instance_of_the_same_function():
    one, other = instance("ugv-bump-energy-d8-v2", seed=7), instance("ugv-bump-energy-d8-v2-s8")
    assert (one.id, one.n, one.known) == ("ugv-bump-energy-d8-v2-s7", 8, None)
    assert len({it.digest() for it in (one, other, instance("ugv-bump-energy-d8-v2"))}) == 3
    assert one.digest() == pickle.loads(pickle.dumps(one)).digest()
    middle = one.objective().middle
    assert one.objective()(middle) != other.objective()(middle)
    for seed in (0, 1.5, 10**9):
        with pytest.raises(ValueError, match="seed = "):
            instance("ugv-bump-energy-d8-v2", seed=seed)
    with pytest.raises(ValueError, match="did you mean gait-time-d16-v2"):
        instance("gait-tim-d16-v2-s1")


def test_a_value_is_proved_or_agreed_or_seen():
    known = instance("gait-time-d16-v2").known
    assert known.standing == "proved within 0.0302 %"
    assert all(0.999 * it.best_known < it.lower_bound for it in suite("gait").values())
    assert replace(known, bound=None, methods=3).standing == "agreed by 3 methods"
    assert replace(known, bound=None).standing == "best seen"


def test_a_changed_instance_is_not_the_recorded_one(monkeypatch):
    one = instance("gait-time-d16-v2")
    other = instance("gait-time-d64-v2")
    assert one.digest() != other.digest()
    monkeypatch.setitem(one.__dict__, "problems", other.problems)
    assert one.digest() != one.known.digest


def test_a_digest_is_of_numbers_to_seven_digits_and_of_all_fields():
    x = np.array([1.0, 1e-3])
    assert parts_of(x) == parts_of(x * (1 + 1e-12))
    assert parts_of(x) != parts_of(x * (1 + 1e-5))
    assert parts_of({"a": 1, "b": (None, "c")}) != parts_of({"a": 1, "b": (None, "d")})
    with pytest.raises(TypeError, match="no digest"):
        parts_of(object())


def test_a_split_costs_the_squared_torques_of_the_forces_that_hold_each_posture():
    params, track, x = UGVParams(), track_named("bump"), np.linspace(2.0, 7.5, 8)
    shares = 0.1 * np.sin(np.arange(8))
    with jax.enable_x64(True):
        problem = split_problem("bump", "squared_torque", 8)
        pose = equilibrium(params, track.astype(float), x, np.full((8, 2), np.pi / 2)).pose
        forces = np.asarray(ground_forces(params, pose, shares * params.weight))
    F, N = forces[::2], forces[1::2]
    expected = np.sum((F * params.wheel_radius) ** 2)
    assert problem.objective(shares) == pytest.approx(expected, rel=1e-12)
    margins = np.stack([0.8 * N - F, 0.8 * N + F, N], axis=0)
    found = np.sort(problem.constraints(shares)) * float(params.weight)
    np.testing.assert_allclose(found, np.sort(margins.ravel()), rtol=1e-9)


@pytest.mark.long
def test_the_usual_vehicle_as_a_design_drives_as_a_posture_problem_says():
    with jax.enable_x64(True):
        problem = vehicle_design("wheel_energy", ("sinusoid",))
    usual = UGVParams()
    straight = [float(usual.body_length), float(usual.leg_length), np.pi / 2, np.pi / 2]
    x = np.linspace(2.5, 8.0, STATIONS)
    drive = PostureProblem(usual, track_named("sinusoid"), x)
    expected = drive.objective(np.full(drive.n, np.pi / 2))
    assert problem.objective(straight) == pytest.approx(expected, rel=1e-9)


def test_a_kink_where_searches_start_is_flagged():
    one = instance("design-biped-energy-d12-v1")
    assert "the middle" in one.flags.kinks
    it = one.objective()
    at, step = it.middle, 1e-6 * np.eye(it.n)[0]
    there = it.constraints(at)
    sides = (it.constraints(at + step) - there, there - it.constraints(at - step))
    assert np.max(np.abs(sides[0] - sides[1])) > 1e-4
