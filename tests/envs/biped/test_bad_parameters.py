"""Parameters that no biped, floor or task can have are refused, saying what is accepted."""

from __future__ import annotations

from dataclasses import fields

import gymnasium
import jax
import numpy as np
import pytest

from stickslip.dynamics import Scene
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.pytrees import rebuilt
from stickslip.envs import BipedEnv, BipedEnvParams, Randomisation, UGVEnv
from stickslip.envs.biped.params import NUMBERS, OPTIONAL
from stickslip.envs.functional import NON_NEGATIVE
from tests.envs.helpers import task


def test_every_number_of_the_parameters_is_checked():
    trees = {"robot", "scene", "unit_payload", "randomisation"}
    assert {field.name for field in fields(BipedEnvParams)} == {*NUMBERS, *OPTIONAL, *trees}


@pytest.mark.parametrize("value", [np.nan, -0.1])
@pytest.mark.parametrize("name", NUMBERS)
def test_a_bad_number_is_named_with_what_was_given_and_what_is_accepted(name, value):
    with pytest.raises(ValueError, match=rf"{name} = .*accepted: finite, >=? 0") as caught:
        task()[1].replace(**{name: value})
    assert str(value) in str(caught.value)


def test_zero_switches_a_term_off():
    terms = [name for name, rule in NUMBERS.items() if rule is NON_NEGATIVE]
    assert len(terms) == 5
    params = task()[1].replace(**dict.fromkeys(terms, 0.0))
    assert not any(getattr(params, name) for name in terms)


def test_unknown_fields_are_refused():
    with pytest.raises(ValueError, match=r"'speed' is no field; accepted: robot, scene"):
        task()[1].replace(speed=3.0)
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
        ({"mass": (1.0, np.nan)}, r"mass = nan is not accepted"),
        ({"phase": (2.0, 5.0)}, r"phase = 5\.0 is not accepted; .*high <= 4\.71"),
        ({"phase": (1.0,)}, r"phase = \(1\.0,\) is no range; accepted: \(low, high\)"),
        ({"robot": (0, 1)}, r"robot = \(0, 1\); accepted: whole numbers, places in a batch"),
    ],
)
def test_a_bad_range_is_named_with_what_is_accepted(ranges, message):
    with pytest.raises(ValueError, match=message):
        BipedEnv().make_params(randomisation=Randomisation(**ranges))


def test_a_batch_of_robots_is_drawn_from_or_mapped_over():
    env, key = BipedEnv(), jax.random.key(0)
    params = env.make_params(robot=BipedParams.from_bars(crank_length=[0.03, 0.033]))
    with pytest.raises(ValueError, match=r"robot is a batch \(2,\); accepted: one, vmap"):
        env.reset(key, params)
    with pytest.raises(ValueError, match=r"robot = \(0, 0\.5\); .* in a batch of robots \(n,\)$"):
        params.replace(randomisation=Randomisation(robot=(0, 0.5)))


def test_friction_cannot_be_drawn_on_a_grip_floor():
    drawn = Randomisation(friction=(0.5, 1.0))
    with pytest.raises(ValueError, match=r"friction cannot be drawn on a grip floor"):
        BipedEnv().make_params(scene=Scene.grip(), randomisation=drawn)


def test_a_robot_that_cannot_be_is_refused():
    open_ = rebuilt(task()[1].robot, closes=np.asarray(False))
    with pytest.raises(ValueError, match=r"robot: its linkage cannot close"):
        task()[1].replace(robot=open_)
    two, one = BipedParams.from_bars(femur_pin=[3.0, 3.2]), Randomisation(robot=(0, 0))
    with pytest.raises(ValueError, match=r"this linkage breaks the exchange .* by 0\.198"):
        BipedEnv().make_params(robot=two, randomisation=one)
    lame = rebuilt(BipedParams.from_bars(), heel=np.float32(-0.1))
    with pytest.raises(ValueError, match=r"heel = -0\.1.* is not accepted"):
        BipedEnv().make_params(robot=lame)
