"""`stickslip simulate ugv`: a drive by its file or by two angles, beside the posture problem."""

import json
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import OK, main
from stickslip.commands import NOTHING_FOUND
from stickslip.optim import CRITERIA, PostureProblem
from stickslip.simulate.ugv import read_posture
from tests.asked import prints, tells

pytestmark = pytest.mark.usefixtures("empty_directory")

HELD = ["simulate", "ugv", "--angles", "60", "90", "--set", "spacing=1"]


def test_a_posture_held_is_worth_what_the_problem_says(capsys):
    told = tells(capsys, *HELD)
    problem = PostureProblem.along("bump", spacing=1.0)
    x = np.tile(np.radians([60.0, 90.0]), len(problem.x))
    assert [row["criterion"] for row in told["criteria"]] == list(CRITERIA)
    (energy,) = (row for row in told["criteria"] if row["criterion"] == "wheel_energy")
    assert energy["value"] == problem.objective(x)
    places, angles = read_posture("drive.csv")
    np.testing.assert_array_equal(places, problem.x)
    np.testing.assert_array_equal(angles.ravel(), x)


@pytest.mark.long
def test_a_drive_is_drawn_and_filmed_at_one_metre_a_second():
    image = pytest.importorskip("PIL.Image")
    assert main([*HELD, "--set", "end=3", "--plot=drive.png", "--film=drive.webp"]) == OK
    assert Path("drive.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    length = np.ptp(read_posture("drive.csv")[0])
    with image.open("drive.webp") as film:
        assert film.n_frames == pytest.approx(25 * length, abs=2)


def test_a_drive_from_a_file_is_the_same_drive_and_a_slip_is_said(capsys):
    assert main([*HELD, "--out=a.csv"]) == OK
    assert main(["simulate", "ugv", "--posture=a.csv", "--out=b.csv"]) == OK
    assert Path("a.csv").read_bytes() == Path("b.csv").read_bytes()
    again = ["simulate", "ugv", "--posture=a.csv", "--friction=0.02", "--out=c.csv", "--json"]
    told = json.loads(prints(capsys, *again, status=NOTHING_FOUND))
    assert told["summary"][0]["status"] == "WHEEL_SLIP"
    assert told["summary"][0]["slips"] == Path("c.csv").read_text().count("WHEEL_SLIP")
    assert told["missed"]["grip"] > 0
    assert (told["feasible"], told["exit_status"]) == (False, NOTHING_FOUND)
