"""The commands: what they write, and wrong input in a line."""

import json
import re
import sys
from pathlib import Path

import pytest

from stickslip.cli import OK, main
from tests.agents.optimisers.table import NAME, kept, run
from tests.asked import prints, refusal

pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")
PAGE = Path(__file__).parents[3] / "docs" / "suite.md"


def test_a_report_of_two_races(tmp_path, capsys):
    runs = [run([(3, 1.0), (9, 0.005)], 50, seed=seed) for seed in range(2)]
    mine = kept([*runs, run([], 9, name=f"{NAME}-s1")], tmp_path / "mine")
    theirs = kept([run([(20, 0.1)], 90, method="theirs")], tmp_path / "theirs")
    out = tmp_path / "report"
    arguments = ["bench", "report", str(mine), str(theirs), "--out", str(out)]
    printed = prints(capsys, *arguments)
    assert "4 runs of 2 methods on 2 instances" in printed
    assert "mine 13.5 (9 to inf, 2/3)" in printed
    assert "| theirs | 0.1 (0%)" in printed
    names = {"report.md", "ecdf_evaluations.png", "ecdf_seconds.png"}
    assert {one.name for one in out.iterdir()} == names
    assert "exists; accepted: a new directory" in refusal(capsys, *arguments)
    assert main([*arguments[:-1], str(tmp_path / "again"), "--stored", "--json"]) == OK
    methods = [row["method"] for row in json.loads(capsys.readouterr().out)["closeness"]]
    assert methods[:2] == ["mine", "theirs"]
    assert {"slsqp", "cma", "conic"} <= set(methods)


@pytest.mark.long
def test_the_optimiser_of_the_page_races_beside_the_package_s_runs(tmp_path, monkeypatch, capsys):
    code = next(
        one for one in re.findall(r"(?s)```py\n(.*?)```", PAGE.read_text()) if "def search(" in one
    )
    (tmp_path / "mine.py").write_text(code)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    given = ["--instances", "ugv-bump-energy-d8-v2-s1", "--budget", "2000", "--seeds", "1"]
    printed = prints(capsys, "bench", "run", "--methods", "mine:search", *given, "--out", "race")
    assert re.search(r"\| mine:search +\| [\d.e-]+ \(\d+%\)", printed)
    assert re.search(r"\| dp-scp +\| [\d.e-]+ \(100%\)", printed)
