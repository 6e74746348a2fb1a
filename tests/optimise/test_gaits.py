"""`stickslip optimise biped`: what it prints, what it writes, how it refuses."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.commands import NOTHING_FOUND
from tests.asked import prints, tells

pytestmark = pytest.mark.usefixtures("empty_directory")

SMALL = ["optimise", "biped", "--set=cells=40", "--mu=0.1"]


@pytest.mark.long
def test_the_table_the_json_and_the_nodes_tell_the_same(capsys):
    pytest.importorskip("matplotlib")
    asked = ["--objective=energy", "--mean-rate=4", "--set=reserve=0.05", "--out=run"]
    printed = prints(capsys, *SMALL, *asked)
    found = json.loads(Path("run/result.json").read_text(encoding="utf-8"))["result"]
    with Path("run/gait.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    columns = {name: np.array(of, float) for name, *of in zip(*rows, strict=True)}
    torque, angle = columns["torque [N m]"], columns["crank angle [rad]"]
    work = np.trapezoid(np.maximum(torque, 0.0), angle)
    assert found["spent"]["work"] == pytest.approx(work, rel=2e-2)
    assert columns["time [s]"][-1] == pytest.approx(np.pi / 4, rel=1e-2)
    use = np.abs(columns["friction force [N]"] / columns["normal force [N]"])
    assert np.max(use) <= 0.095 * (1 + 1e-6)
    assert found["status"] == "OPTIMAL"
    assert found["every_bound"] <= found["lower_bound"] * (1 + 1e-2)
    assert re.search(rf"value +{found['value']:.8g} J", printed)
    assert all(one["steps"] == 3 for one in found["replays"].values())
    assert Path("run/gait.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_where_there_is_no_gait_it_says_why_and_ends_with_its_own_status(capsys):
    asked = [*SMALL, "--objective=energy", "--mean-rate=30", "--no-pictures"]
    told = tells(capsys, *asked, status=NOTHING_FOUND)
    assert (told["result"]["value"], told["result"]["unit"]) == (None, "J")
    assert [one.name for one in Path("runs/biped-energy").iterdir()] == ["result.json"]
    printed = prints(capsys, *asked[:-1], "--overwrite", status=NOTHING_FOUND)
    assert "INFEASIBLE" in printed
    assert "mean_rate = 30 rad/s cannot be met" in printed
    assert [one.name for one in Path("runs/biped-energy").iterdir()] == ["result.json"]
