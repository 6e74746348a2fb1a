"""Machines from TOML files: numbers and units, round trips, every number reachable, bad files."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import PLACES as ROBOT
from stickslip.dynamics.biped.robot_file import read_robot
from stickslip.dynamics.ugv import UGVParams
from stickslip.dynamics.ugv.vehicle_file import PLACES as VEHICLE
from stickslip.dynamics.ugv.vehicle_file import read_vehicle


def leaves(machine):
    return [np.asarray(one) for one in jax.tree.leaves(machine)]


def same(one, other):
    return all(map(np.array_equal, leaves(one), leaves(other)))


@pytest.mark.parametrize("x64", [False, True])
def test_a_robot_and_a_vehicle_come_back_from_their_files(tmp_path, x64):
    with jax.enable_x64(x64):
        robot = BipedParams.from_bars(crank_length=0.0371, hip_mass=1 / 3, payload=0.1)
        vehicle = UGVParams(body_length=np.sqrt(2), leg_angle_min=0.6)
        for machine in (robot, vehicle):
            path = machine.to_file(tmp_path / f"{type(machine).__name__}.toml")
            assert same(type(machine).from_file(path), machine)


def test_units_are_those_of_the_file(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(
        'payload = "200 g"\n[bars]\ncrank_length = "40 mm"\nfemur = "360 mm"\nhip_mass = "1.2 kg"\n'
        '[links.tibia]\nmass = "700 g"\ncentre = ["3 cm", 0.001]\ninertia = "9e4 g cm^2"\n'
        '[motor]\ntorque_limit = "600 N cm"\n'
    )
    robot, plain = (
        BipedParams.from_file(path),
        BipedParams.from_bars(crank_length=0.04, hip_mass=1.2, payload=0.2, femur=9.0),
    )
    tibia = {"mass": 0.7, "centre": [0.03, 0.001], "inertia": 9e-3}
    expected = plain.replace(**{name: np.array(getattr(plain, name)) for name in tibia})
    for name, value in tibia.items():
        getattr(expected, name)[1] = value
    assert all(map(np.allclose, leaves(robot), leaves(expected)))
    assert read_robot(path).motor == {"torque_limit": 6.0}


def test_every_number_of_both_machines_is_reached_by_name(tmp_path):
    base = BipedParams.from_file(None)
    fields = {name for name in ROBOT if name.startswith("robot.")}
    for name in ROBOT:
        if name.startswith("motor."):
            assert read_robot(None, {name: "3"}).motor == {name[6:]: 3.0}
            continue
        value = 0.0011 if "inertia" in name or "centre" in name else None
        with jax.enable_x64(True):
            before = _number(base, ROBOT[name])
            value = before * 1.001 if value is None and before else value or 0.01
            changed = BipedParams.from_file(None, {name: str(value)})
        assert not same(changed, base), name
        if name in fields and ROBOT[name][0] != "bars":
            assert _number(changed, ROBOT[name]) == pytest.approx(value, rel=1e-6), name
    for name, (_, field) in VEHICLE.items():
        if name.startswith("motor."):
            assert read_vehicle(None, {name: "3"})[1] == {field: 3.0}
            continue
        value = float(getattr(UGVParams(), field)) * 1.01 + 0.001 * (field == "wheel_gap")
        assert getattr(UGVParams.from_file(None, {name: str(value)}), field) == value
    with pytest.raises(ValueError, match=r"'robot\.hipmass' is no number of a robot; .*hip_mass"):
        BipedParams.from_file(None, {"robot.hipmass": 1.0})


def _number(robot, place):
    """The number of a robot at a place of its file; a usual one of `from_bars`."""
    if place[0] == "bars":
        usual = {"crank_length": 0.03, "bar_density": 1.48, "hip_mass": 0.7, "foot_mass": 0.3}
        usual |= {"foot_inertia": 1e-3, "hip_span": 16.0}
        return usual.get(place[1]) or float(getattr(robot, place[1]) / robot.crank)
    if place[0] != "links":
        return float(getattr(robot, place[-1]))
    from stickslip.dynamics.biped.robot_file import NAMES

    row = getattr(robot, place[2])[NAMES.index(place[1])]
    return float(row if len(place) == 3 else row[place[3]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[bars]\ncrank_length = "40 kg"', "bars.crank_length = '40 kg' is not in m; accepted: a"),
        ("[bars]\ncrank_lenght = 1", "'crank_lenght' is no entry of .bars.; .*crank_length"),
        ("[bars]\nhip_mass = -1", "hip_mass = -1.0 is not accepted"),
        ('[bars]\nfemur = "9**9**9 m"', "bars.femur = '9..9..9 m' is not in m"),
        ("[links.tibia]\ncentre = 3", "links.tibia.centre = 3; accepted: a pair"),
        ("[lengths]\nrocker = 5", "close"),
        ("bars = 3", "bars = 3; accepted: a table"),
        ('machine = "ugv"', "machine = 'ugv'; accepted: 'biped'"),
        ("x =", "is not TOML"),
    ],
)
def test_a_bad_file_is_one_line_with_file_entry_and_what_is_accepted(tmp_path, text, message):
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        BipedParams.from_file(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_file_is_replaced_and_no_batch_is_written(tmp_path):
    path = UGVParams().to_file(tmp_path / "v.toml")
    with pytest.raises(ValueError, match="exists"):
        UGVParams(leg_mass=1.0).to_file(path)
    assert UGVParams.from_file(path) == UGVParams()
    UGVParams(leg_mass=1.0).to_file(path, overwrite=True)
    assert UGVParams.from_file(path).leg_mass == 1.0
    for batch in (UGVParams(leg_mass=np.ones(2)), BipedParams.from_bars(hip_mass=np.ones(2))):
        with pytest.raises(ValueError, match="accepted: one"):
            batch.to_file(tmp_path / "batch.toml")
    with pytest.raises(ValueError, match="no such file"):
        BipedParams.from_file(tmp_path / "none.toml")
