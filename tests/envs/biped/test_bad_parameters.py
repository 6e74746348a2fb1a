"""Parameters that no biped, floor or task can have are refused, saying what is accepted."""

from __future__ import annotations

from dataclasses import fields, replace

import gymnasium
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams, Table
from stickslip.dynamics.pytrees import rebuilt
from stickslip.envs import BipedEnv, BipedEnvParams, Randomisation, UGVEnv
from tests.envs.helpers import task

POSITIVE = (
    "torque_limit",
    "control_period",
    "mean_rate",
    "time_limit",
    "max_crank_rate",
)
NON_NEGATIVE = ("copper_loss", "tracking_weight", "slip_weight", "energy_weight", "fall_penalty")
TREES = {"robot", "scene", "unit_payload", "randomisation"}
MARK = {"mark", "mark_width"}
"""Looked at in test_mark.py."""


def test_every_number_of_the_parameters_is_checked():
    assert {field.name for field in fields(BipedEnvParams)} == {
        *POSITIVE,
        *NON_NEGATIVE,
        *TREES,
        *MARK,
    }


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -0.1, "fast"])
@pytest.mark.parametrize("name", [*POSITIVE, *NON_NEGATIVE])
def test_a_bad_number_is_named_with_what_was_given_and_what_is_accepted(name, value):
    with pytest.raises(ValueError, match=rf"{name} = .*accepted: finite, >=? 0") as caught:
        task()[1].replace(**{name: value})
    assert str(value) in str(caught.value)


@pytest.mark.parametrize("name", POSITIVE)
def test_zero_is_refused_where_it_would_divide(name):
    with pytest.raises(ValueError, match=rf"{name} = 0\.0 is not accepted; accepted: finite, > 0"):
        task()[1].replace(**{name: 0.0})


@pytest.mark.parametrize("name", NON_NEGATIVE)
def test_zero_switches_a_term_off(name):
    assert getattr(task()[1].replace(**{name: 0.0}), name) == 0.0


def test_one_bad_number_of_a_batch_is_found():
    with pytest.raises(ValueError, match=r"torque_limit = -1\.0 \(one of \(3,\)\)"):
        task()[1].replace(torque_limit=np.asarray([4.0, -1.0, 2.0]))


def test_numbers_are_checked_when_parameters_are_made():
    with pytest.raises(ValueError, match=r"control_period = -0\.02"):
        BipedEnv().make_params(control_period=-0.02)


def test_unknown_fields_are_refused():
    with pytest.raises(ValueError, match=r"'speed' is no field; accepted: robot, scene"):
        task()[1].replace(speed=3.0)
    with pytest.raises(ValueError, match=r"'slip_wieght' is no .*did you mean slip_weight\?"):
        BipedEnv().make_params(slip_wieght=3.0)
    with pytest.raises(ValueError, match=r"'slip_wieght' is no .*did you mean slip_weight\?"):
        gymnasium.make("stickslip/Biped-v0", slip_wieght=1)
    with pytest.raises(ValueError, match=r"'substep' is no .*did you mean substeps\?"):
        BipedEnv(substep=2)
    with pytest.raises(ValueError, match=r"'frictoin' is no .*did you mean friction\?"):
        UGVEnv().make_params(frictoin=1.0)


@pytest.mark.parametrize(
    ("ranges", "message"),
    [
        ({"friction": (2.0, 1.0)}, r"friction = \(2\.0, 1\.0\) has low > high; accepted"),
        ({"friction": (-0.5, 1.0)}, r"friction = -0\.5 is not accepted; .*low >= 0"),
        ({"mass": (0.0, 1.0)}, r"mass = 0\.0 is not accepted"),
        ({"mass": (1.0, np.nan)}, r"mass = nan is not accepted"),
        ({"payload": (0.0, np.inf)}, r"payload = inf is not accepted"),
        ({"mean_rate": (0.0, 1.0)}, r"mean_rate = 0\.0 is not accepted"),
        ({"phase": (1.0,)}, r"phase = \(1\.0,\) is no range; accepted: \(low, high\)"),
        ({"phase": 2.0}, r"phase = 2\.0 is no range"),
        ({"crank_rate": "fast"}, r"crank_rate = 'fast' is no range"),
        ({"crank_rate": ("a", "b")}, r"crank_rate = 'a' is not a number"),
    ],
)
def test_a_bad_range_is_named_with_what_is_accepted(ranges, message):
    with pytest.raises(ValueError, match=message):
        BipedEnv().make_params(randomisation=Randomisation(**ranges))


@pytest.mark.parametrize(("low", "high"), [(0.0, 3.0), (2.0, 5.0), (-1.0, 100.0)])
def test_a_phase_that_no_supporting_leg_has_is_refused(low, high):
    with pytest.raises(ValueError, match=r"phase = \(.*; accepted: within pi/2 to 3 pi/2"):
        BipedEnv().make_params(randomisation=Randomisation(phase=(low, high)))


def test_friction_cannot_be_drawn_on_a_grip_floor():
    drawn = Randomisation(friction=(0.5, 1.0))
    with pytest.raises(ValueError, match=r"friction cannot be drawn on a grip floor"):
        BipedEnv().make_params(scene=Scene.grip(), randomisation=drawn)


def test_an_impossible_floor_is_refused():
    params = task()[1]
    floor = replace(params.scene.floor, mu_static=0.1, mu_kinetic=0.2)
    with pytest.raises(ValueError, match=r"mu_kinetic = 0\.2 exceeds mu_static = 0\.1"):
        params.replace(scene=replace(params.scene, floor=floor))


def test_a_robot_that_cannot_be_is_refused():
    open_ = rebuilt(task()[1].robot, closes=np.asarray(False))
    with pytest.raises(ValueError, match=r"robot: its linkage cannot close"):
        task()[1].replace(robot=open_)
    lame = rebuilt(BipedParams.from_bars(), heel=np.float32(-0.1))
    with pytest.raises(ValueError, match=r"heel = -0\.1.* is not accepted"):
        BipedEnv().make_params(robot=lame)


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"substeps": 0}, r"substeps = 0; accepted: an integer >= 1"),
        ({"substeps": 1.5}, r"substeps = 1\.5; accepted"),
        ({"max_events": 0}, r"max_events = 0; accepted"),
        ({"fidelity": "fine"}, r"fidelity = 'fine' is unknown; accepted: 'joint', 'reduced'"),
        ({"fidelity": None}, r"fidelity = None is unknown"),
        ({"see_friction": "yes"}, r"see_friction = 'yes'; accepted: True or False"),
        ({"see_patch": 1}, r"see_patch = 1; accepted: True or False"),
        ({"autoreset": "always"}, r"autoreset = 'always' is unknown; accepted: 'same_step'"),
    ],
)
def test_a_bad_choice_is_named_with_what_is_accepted(choices, message):
    with pytest.raises(ValueError, match=message):
        BipedEnv(**choices)


def test_choices_are_static_and_hashable():
    assert hash(BipedEnv()) == hash(BipedEnv())
    assert len({BipedEnv(), BipedEnv(), BipedEnv(substeps=2), BipedEnv(fidelity=Table(16, 5))}) == 3
