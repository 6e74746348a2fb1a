"""Torques and postures from users' files: read to the last digit, or refused by name and line."""

from pathlib import Path

import numpy as np
import pytest

from stickslip.simulate.torque import Recorded, torque_of
from stickslip.simulate.ugv import read_posture

pytestmark = pytest.mark.usefixtures("empty_directory")


def recorded(content: str) -> Recorded:
    Path("given.csv").write_text(content)
    found = torque_of("given.csv")
    assert isinstance(found, Recorded)
    return found


@pytest.mark.parametrize(
    "content",
    [
        "time [s],torque [N m]\n0,0.1\n0.30000000000000004,2\n",
        "status;TIME;tau (N m)\nOK;0;0,1\nOK;0,30000000000000004;2",
    ],
)
def test_times_and_torques_are_read_and_interpolated(content: str):
    found = recorded(content)
    assert found.times.tolist() == [0.0, 0.30000000000000004]
    assert found.values.tolist() == [0.1, 2.0]
    np.testing.assert_allclose(found.at(np.array([0.0, 0.15, 0.3])), [0.1, 1.05, 2.0], rtol=1e-12)
    with pytest.raises(ValueError, match=r"torques from 0 to 0\.3 s"):
        found.at(np.array([0.0, 0.4]))


def test_a_file_of_another_kind_is_told_from_arithmetic():
    Path("t").write_text("0,1")
    with pytest.raises(ValueError, match=r"accepted: a \.csv"):
        torque_of("t")
    Path("d.csv").mkdir()
    with pytest.raises(ValueError, match="not a regular file"):
        torque_of("d.csv")
    assert torque_of("1e-3") == 1e-3


def test_a_posture_needs_places_that_advance():
    head = "front wheel [m],rear leg angle [rad],front leg angle [rad]\n"
    for rows, said in (("1,1,1\n", "one row"), ("1,1,1\n1,2,2\n", "wheel = 1.0 after 1.0")):
        Path("drive.csv").write_text(head + rows)
        with pytest.raises(ValueError, match=said):
            read_posture("drive.csv")
    Path("drive.csv").write_text(
        head.replace("rear leg angle [rad]", "rear leg angle [deg]") + "0,90,1\n1,180,2\n"
    )
    np.testing.assert_allclose(read_posture("drive.csv")[1], [[np.pi / 2, 1], [np.pi, 2]])
    with pytest.raises(ValueError, match=r"ends in '\.txt'"):
        read_posture("drive.txt")
