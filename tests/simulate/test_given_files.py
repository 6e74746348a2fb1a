"""Torques and postures from users' files: read to the last digit, or refused by name and line."""

from pathlib import Path

import numpy as np
import pytest

from stickslip.simulate.torque import Recorded, torque_of
from stickslip.simulate.ugv import read_posture

HEAD = "time [s],torque [N m]\n"


@pytest.fixture(autouse=True)
def _in_an_empty_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)


def recorded(content: str | bytes, name: str = "given.csv") -> Recorded:
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    found = torque_of(name)
    assert isinstance(found, Recorded)
    return found


@pytest.mark.parametrize(
    "content",
    [
        HEAD + "0,0.1\n0.30000000000000004,2\n",
        "\ufeffother,torque,time\n7,0.1,0\n# a note\n\n,2,0.30000000000000004\n",
        "0,0.1\r\n0.30000000000000004,2\r\n",
    ],
)
def test_times_and_torques_are_found_by_name_or_place(content: str):
    found = recorded(content)
    assert found.times.tolist() == [0.0, 0.30000000000000004]
    assert found.torques.tolist() == [0.1, 2.0]
    np.testing.assert_allclose(found.at(np.array([0.0, 0.15, 0.3])), [0.1, 1.05, 2.0], rtol=1e-12)
    with pytest.raises(ValueError, match=r"torques from 0 to 0\.3 s"):
        found.at(np.array([0.0, 0.4]))


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "given.csv is empty"),
        (HEAD + "0,1\n1,nan\n", "given.csv:3: torque = 'nan' is no finite number"),
        ("time,torqe\n0,1\n", r"no column 'torque' among .*did you mean torqe"),
        ("time,torque [lbf.ft]\n0,1\n", "is in 'lbf.ft'; accepted: Nm, mNm, "),
        (HEAD + "0,1\n0,2\n", "given.csv:3: time = 0.0 after 0.0 does not increase"),
        (HEAD + '0,"1\n', "given.csv:2: unexpected end of data"),
        (b"\x80\x81", "byte 0 is no UTF-8 text"),
    ],
)
def test_a_damaged_file_is_refused_by_name_and_line(content: str | bytes, said: str):
    with pytest.raises(ValueError, match=said):
        recorded(content)


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


@pytest.mark.parametrize(
    "text",
    [
        "time (s),torque (Nm)\n0,0.5\n1.5,-2",
        "# by a logger\nTorque [N*m]\tTime\n0,5\t0\n-2\t1,5",
        "time [ms],torque_kNm\n0,0.0005\n1500,-0.002",
        "status;TIME;tau (N m)\nOK;0;0,5\nOK;1,5;-2",
    ],
)
def test_tables_of_other_programs_are_read(text: str):
    found = recorded(text)
    assert (found.times.tolist(), found.torques.tolist()) == ([0.0, 1.5], [0.5, -2.0])
