"""The commands: what they write, and wrong input in a line."""

import json
import re
from importlib import import_module
from pathlib import Path

import pytest

from stickslip.agents.optimisers import METHODS, read_results, write_results
from stickslip.races import EXAMPLES, PROGRAM, make_parser
from stickslip.races import run as command
from tests.agents.optimisers.table import NAME, run

pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")
PAGE = Path(__file__).parents[3] / "docs" / "suite.md"


def test_methods_are_listed(capsys):
    command(["methods"])
    printed = capsys.readouterr().out
    assert all(f"`{name}`" in printed for name in METHODS)


@pytest.mark.parametrize("part", EXAMPLES)
def test_every_part_shows_examples_that_it_takes(part, capsys):
    with pytest.raises(SystemExit):
        command([part, "--help"])
    shown = capsys.readouterr().out
    for line, about in EXAMPLES[part].items():
        assert f"{about}:\n    {line}\n" in shown
        words = line.split()
        assert words[:3] == PROGRAM.split()
        assert make_parser().parse_args(words[3:]).part == part


def test_a_report_of_ones_own_runs_beside_theirs(tmp_path, capsys):
    runs = [run([(3, 1.0), (9, 0.005)], 50, seed=seed) for seed in range(2)]
    several = run([], 9, name="goals-gait-time-energy-d32-v2")
    mine = write_results([*runs, several], tmp_path / "mine.parquet")
    theirs = write_results([run([(20, 0.1)], 90, method="theirs")], tmp_path / "theirs.csv")
    out = tmp_path / "report"
    arguments = ["report", str(mine), str(theirs), "--out", str(out)]
    found = command(arguments)
    printed = capsys.readouterr().out
    assert "4 runs of 2 methods on 2 instances" in printed
    assert "mine 9 (9 to 9, 2/2)" in printed
    assert "| theirs | 0.1 (0%)" in printed
    names = {"report.md", "results.csv", "results.parquet"}
    names |= {"ecdf_evaluations.png", "ecdf_seconds.png"}
    assert {one.name for one in out.iterdir()} == names
    assert len(read_results(out / "results.csv")) == 4
    rows = json.loads(found.json("bench"))["runs"]
    assert [row["seed"] for row in rows] == [0, 1, 0, 0]
    assert (rows[0]["gap"], rows[0]["evaluations"]) == (pytest.approx(0.005), 50)
    with pytest.raises(ValueError, match="exists; accepted: a new directory"):
        command(arguments)


@pytest.mark.long
def test_the_program_of_the_page_runs_as_printed(tmp_path, monkeypatch, capsys):
    (code,) = re.findall(r"(?m)^((?:    .*\n|\n)*    .*race\(.*\n(?:    .*\n)*)", PAGE.read_text())
    lines = [line[4:] for line in code.splitlines() if line.strip()]
    assert len(lines) <= 12
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(
        import_module("stickslip.agents.optimisers.racing"), "cores_here", lambda: 1
    )
    names: dict = {"__name__": "recipe"}
    exec(compile("\n".join(lines), str(PAGE), "exec"), names)
    assert f"{NAME} mine 0" in capsys.readouterr().out
    assert len(names["runs"]) == 4
