"""`stickslip optimise ugv`: what it prints, what it writes, how it refuses."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from stickslip.cli import OK, main
from stickslip.commands import NOTHING_FOUND
from stickslip.dynamics.ugv import UGVParams
from stickslip.optimise.ugv import survey_of, track_options_of, treatments_of
from tests.asked import prints, refusal, tells

pytestmark = pytest.mark.usefixtures("empty_directory")

SMALL = ["optimise", "ugv", "--set", "spacing=1", "leg_rate=none", "angles=4", "polish=false"]
"""Eight waypoints over the bump: every run here shares its compiled programs."""


def stations(path: Path) -> dict[str, np.ndarray]:
    """The columns of numbers of a table of stations, names without units."""
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    names = [name.partition(" [")[0] for name in rows[0]]
    columns = dict(zip(names, zip(*rows[1:], strict=True), strict=True))
    assert set(columns.pop("status")) == {"OK"}
    return {name: np.array(of, dtype=float) for name, of in columns.items()}


def test_the_table_the_json_and_the_stations_tell_the_same(capsys):
    pytest.importorskip("matplotlib")
    printed = prints(capsys, *SMALL, "--out", "run")
    told = json.loads(Path("run/result.json").read_text(encoding="utf-8"))
    found, criteria = told["result"], {one["criterion"]: one["value"] for one in told["criteria"]}
    at = stations(Path("run/stations.csv"))
    work = (at["torque on each wheel"][1:] + at["torque on each wheel"][:-1]) / 2
    work = work * np.diff(at["turn of both wheels"])
    spent = np.sum(np.maximum(work, 0))
    for leg in ("rear", "front"):
        torque = at[f"{leg} leg torque"]
        by_leg = (torque[1:] + torque[:-1]) / 2 * np.diff(at[f"{leg} leg angle"])
        spent = spent + np.sum(np.maximum(by_leg, 0))
    assert found["value"] == pytest.approx(np.sum(np.maximum(work, 0)), rel=1e-6)
    assert criteria["wheel_energy"] == pytest.approx(found["value"], rel=1e-12)
    assert criteria["total_energy"] == pytest.approx(spent, rel=1e-6)
    assert found["lower_bound"] is None
    assert found["details"]["grid_bound"] == pytest.approx(found["value"], rel=1e-9)
    assert found["status"] == "FEASIBLE"
    assert found["feasible"] is True
    assert re.search(rf"bound over the grid +{found['value']:.8g} J", printed)
    assert "lower bound" not in printed
    assert re.search(rf"total_energy +{criteria['total_energy']:.6g} +J", printed)
    assert abs(found["fine_value"] / found["value"] - 1) > 0.05
    assert found["fine_spacing"] == pytest.approx(np.diff(at["front wheel"])[0] / 10, rel=1e-6)
    assert re.search(rf"value between waypoints +{found['fine_value']:.8g} J", printed)
    assert "4 x 4 leg angles" in printed
    np.testing.assert_allclose(np.array(found["leg_angles"])[:, 0], at["rear leg angle"], atol=1e-9)
    assert Path("run/drive.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_a_result_in_the_way_is_kept_unless_it_may_be_replaced(capsys):
    Path("run").mkdir()
    Path("run/notes").write_text("mine")
    assert "run exists" in refusal(capsys, *SMALL, "--out", "run")
    assert [path.name for path in Path("run").iterdir()] == ["notes"]
    again = [*SMALL, "--out=run", "--overwrite", "--no-pictures"]
    Path("run/drive.png").write_text("an older one")
    assert main(again) == OK
    assert {p.name for p in Path("run").iterdir()} == {"notes", "result.json", "stations.csv"}
    assert "Written: run/result.json, run/stations.csv" in capsys.readouterr().out
    Path("flat").write_text("mine")
    assert "flat is a file" in refusal(capsys, *SMALL, "--out", "flat", "--overwrite")
    assert Path("flat").read_text() == Path("run/notes").read_text() == "mine"


def test_where_there_is_no_drive_it_says_so_and_ends_with_its_own_status(capsys):
    told = tells(capsys, *SMALL, "--max-torque=1e-3", status=NOTHING_FOUND)
    assert (told["exit_status"], told["result"]["value"]) == (NOTHING_FOUND, None)
    assert told["problem"]["max_torque"] == 1e-3
    assert told["units"]["summary"]["value"] == "J"
    shown = prints(capsys, *SMALL, "--friction=0", "--overwrite", status=NOTHING_FOUND)
    assert re.search(r"FAILED: no usable answer\n.*no paths over the 4 x 4 grid", shown)
    (folder,) = Path("runs").iterdir()
    assert folder.name == "ugv-bump-wheel_energy-dp"
    names = {path.name for path in folder.iterdir()}
    assert names - {"closest.png"} == {"result.json", "closest.csv"}
    assert re.search(r"misses least +grip by .* N at .* m\n", shown)
    found = json.loads((folder / "result.json").read_text(encoding="utf-8"))["result"]
    assert (found["value"], found["leg_angles"], found["status"]) == (None, None, "FAILED")


def test_tracks_come_by_name_with_their_numbers_or_from_a_file():
    named = survey_of("bump", ["height=0.2", "centre=3"]).track
    assert float(named.height(3.0)) == pytest.approx(0.2)
    Path("hill.txt").write_text("0 0\n1 0.5\n2 0\n")
    ground = survey_of("hill.txt", ["interpolation=linear"]).track
    assert float(ground.height(0.5)) == pytest.approx(0.25)
    assert track_options_of(["a=1", "b=-2.5", "c=x", "a=3"]) == {"a": 3, "b": -2.5, "c": "x"}


@pytest.mark.long
def test_treated_ground_is_drawn_and_written_with_what_was_changed(capsys):
    pytest.importorskip("matplotlib")
    x = np.append(np.arange(0.0, 8.5, 0.5), 8.0)
    y = 0.1 * np.exp(-((x - 4) ** 2)) + np.where(x == 2, 3.0, 0.0)
    np.savetxt("hill.csv", np.stack([x, y], 1), delimiter=",", header="x,y", comments="")
    hill = ["--track", "hill.csv", "--out", "run"]
    assert "--ground merge" in refusal(capsys, *SMALL, *hill)
    assert main([*SMALL, *hill, "--ground=merge,outliers=1m"]) == OK
    told = json.loads(Path("run/result.json").read_text(encoding="utf-8"))["ground"][0]
    assert (told["dropped"], told["merged"], told["knots"]) == (1, 1, 16)
    assert "dropped" in capsys.readouterr().out
    used = np.loadtxt("run/ground.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(used[:, 0], x[:-1][x[:-1] != 2])
    assert Path("run/ground.png").read_bytes().startswith(b"\x89PNG")


def test_lengths_of_treatments_have_units_and_defaults(capsys):
    words = "merge, noise=20cm,smooth=2m,gaps=1e1,envelope"
    expected = {"merge": 0.0, "noise": 0.2, "smooth": 2.0, "gaps": 10.0, "envelope": 0.22}
    assert treatments_of(words, UGVParams(wheel_radius=0.2)) == pytest.approx(expected)
    for words in ("noise", "noise=", "noise=3kg", "noise=-x"):
        with pytest.raises(ValueError, match=r"--ground noise = .*accepted: a number \[m\]"):
            treatments_of(words, UGVParams())
    for words in ("", "noises=3"):
        with pytest.raises(ValueError, match=r"--ground = .* is unknown"):
            treatments_of(words, UGVParams())
    assert "with a file of points" in refusal(capsys, *SMALL, "--ground=merge")
