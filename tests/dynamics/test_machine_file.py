"""Machines from TOML files: numbers and units, round trips, every number reachable, bad files."""

import jax
import numpy as np
import pytest

from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.biped.robot_file import NAMES, ROBOT
from stickslip.dynamics.ugv import UGVParams
from stickslip.dynamics.ugv.params import MOTOR, VEHICLE


def leaves(machine):
    return [np.asarray(one) for one in jax.tree.leaves(machine)]


def same(one, other):
    return all(map(np.array_equal, leaves(one), leaves(other)))


@pytest.mark.parametrize("x64", [False, True])
def test_a_robot_and_a_vehicle_come_back_from_their_files(tmp_path, x64):
    with jax.enable_x64(x64):
        robot = BipedParams.from_bars(crank_length=0.0371, hip_mass=1 / 3, payload=0.1)
        for machine in (robot, UGVParams(body_length=np.sqrt(2), leg_angle_min=0.6)):
            path = machine.to_file(tmp_path / f"{type(machine).__name__}.toml")
            assert same(type(machine).from_file(path), machine)


def test_units_are_those_of_the_file(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(
        'payload = "200 g"\n[bars]\ncrank_length = "40 mm"\nfemur = "360 mm"\nhip_mass = "1.2 kg"\n'
        '[links.tibia]\nmass = "700 g"\ncentre = ["3 cm", 0.001]\ninertia = "9e4 g cm^2"\n'
        '[motor]\ntorque_limit = "600 N cm"\n'
    )
    robot = BipedParams.from_file(path)
    plain = BipedParams.from_bars(crank_length=0.04, hip_mass=1.2, payload=0.2, femur=9.0)
    tibia = {"mass": 0.7, "centre": [0.03, 0.001], "inertia": 9e-3}
    changed = {name: np.array(getattr(plain, name)) for name in tibia}
    for name, value in tibia.items():
        changed[name][1] = value
    assert all(map(np.allclose, leaves(robot), leaves(plain.replace(**changed))))
    assert ROBOT.read(path, {})["motor.torque_limit"] == 6.0


def test_every_number_of_both_machines_is_reached_by_name(tmp_path):
    base = BipedParams.from_file(None)
    for name, place in ROBOT.names.items():
        if name.startswith("motor."):
            assert ROBOT.read(None, {name: "3"})[name] == 3.0
            continue
        value = 0.0011 if "inertia" in name or "centre" in name else None
        with jax.enable_x64(True):
            before = _number(base, place)
            value = before * 1.001 if value is None and before else value or 0.01
            changed = BipedParams.from_file(None, {name: str(value)})
            again = BipedParams.from_file(None).changed({name: value})
            assert all(map(np.allclose, leaves(again), leaves(changed))), name
        assert not same(changed, base), name
        if name.startswith("robot.") and not place.startswith("bars."):
            assert _number(changed, place) == pytest.approx(value, rel=1e-6), name
    for name in VEHICLE.names.keys() - MOTOR.keys():
        field = name.removeprefix("vehicle.")
        value = float(getattr(UGVParams(), field) or 0.1) * 1.01
        assert getattr(UGVParams.from_file(None, {name: str(value)}), field) == value
    with jax.enable_x64(True):
        slope = jax.grad(lambda x: BipedParams.from_bars().changed({"bars.crank_length": x}).femur)
        assert slope(0.03) == pytest.approx(9.0)  # at the robot's own number, too
    with pytest.raises(ValueError, match=r"'robot\.hipmass' is no number of a robot; .*hip_mass"):
        BipedParams.from_file(None, {"robot.hipmass": 1.0})


def test_the_power_of_wheel_motors_limits_their_torque():
    given = {"motor.torque_limit": "90", "motor.max_power": "0.2 kW", "motor.speed": "0.7 m/s"}
    assert UGVParams.with_motor(None, given).motor == {"max_torque": pytest.approx(80.0)}
    given |= {"motor.max_power": "250 W", "vehicle.wheel_radius": 0.3}
    assert UGVParams.with_motor(None, given).motor == {"max_torque": 90.0}
    assert UGVParams.with_motor(None, {"motor.torque_limit": "3"}).motor == {"max_torque": 3.0}
    said = r"motor\.max_power = .* with motor\.speed = .*accepted: both"
    with pytest.raises(ValueError, match=said):
        UGVParams.with_motor(None, {"motor.max_power": "250 W"})
    with pytest.raises(ValueError, match=r"motor\.speed = 0\.0 is not accepted"):
        UGVParams.with_motor(None, given | {"motor.speed": 0.0})


def _number(robot, place):
    """The number of a robot at a place of its file; a usual one of `from_bars`."""
    table, *rest = place.split(".")
    if table == "bars":
        usual = {"crank_length": 0.03, "bar_density": 1.48, "hip_mass": 0.7, "foot_mass": 0.3}
        usual |= {"foot_inertia": 1e-3, "hip_span": 16.0, "hip_centre": -6.0}
        return usual.get(rest[0]) or float(getattr(robot, rest[0]) / robot.crank)
    if table == "links":
        link, field, *axis = rest
        return float(getattr(robot, field)[(NAMES.index(link), *map(int, axis))])
    return float(getattr(robot, place.split(".")[-1]))


def test_bars_of_a_robot_given_link_by_link_change_and_other_links_stay(tmp_path):
    robot = BipedParams.from_bars()
    mass = robot.mass * np.where(np.arange(13) == 1, 2.0, 1.0).astype("f4")
    path = robot.replace(mass=mass).to_file(tmp_path / "my.toml")
    before, after = (
        BipedParams.from_file(path, changes)
        for changes in ({}, {"robot.crank_length": "60 mm", "robot.bar_density": 3.0})
    )
    assert after.femur == pytest.approx(2 * before.femur)
    assert after.mass[2] == pytest.approx(before.mass[2] * 2 * 3 / 1.48)
    assert after.mass[1] == before.mass[1]
    shifted = robot.replace(centre=robot.centre + 0.001).to_file(tmp_path / "shifted.toml")
    with pytest.raises(ValueError, match=r"robot\.bar_density changes nothing; accepted"):
        BipedParams.from_file(shifted, {"robot.bar_density": 3.0})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[bars]\ncrank_length = "40 kg"', "bars.crank_length = '40 kg' is not in m; accepted: a"),
        (
            "[bars]\ncrank_lenght = 1",
            "'bars.crank_lenght' is no number of .*mean bars.crank_length",
        ),
        ("[bars]\nhip_mass = -1", "hip_mass = -1.0 is not accepted"),
        ("[links.tibia]\ninertia = -1", r"links\.tibia\.inertia = -1.0 is not .*accepted: .* >= 0"),
        ('[bars]\nfemur = "9**9**9 m"', "bars.femur = '9..9..9 m' is not in m"),
        ("[links.tibia]\ncentre = 3", "links.tibia.centre. is no .*links.tibia.centre.0"),
        ("[lengths]\nrocker = 5", "close"),
        ("payload = " + 400 * "9", r"payload = 99.*99; accepted: a number \[kg\]"),
        ("bars = 3", "bars. is no number of the file"),
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
    others = {tmp_path / "none.toml": "no such file", tmp_path: "is a directory; accepted: a"}
    for path, said in (others | {"/dev/null": "is no plain file"}).items():
        with pytest.raises(ValueError, match=f"{path}: {said}"):
            BipedParams.from_file(path)
