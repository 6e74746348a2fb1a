"""`stickslip bench`: what it lists, runs, and says where a benchmark cannot run."""

import json
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

import pytest

from stickslip import benchmarks
from stickslip.cli import OK, WRONG_INPUT, main

ROOT = Path(__file__).parents[2]


def test_every_benchmark_of_the_repository_is_listed_under_a_module_that_can_be_run(capsys):
    listed = {f"benchmarks.{name}" for name in benchmarks.BENCHMARKS} - {"benchmarks.optimisers"}
    runs = {
        f"benchmarks.{path.relative_to(ROOT / 'benchmarks').parts[0].removesuffix('.py')}"
        for path in (ROOT / "benchmarks").rglob("*.py")
        if "\nif __name__ == " in path.read_text(encoding="utf-8")
    }
    helpers = {one for one in runs if find_spec(one) is None}
    assert listed == runs - helpers
    assert main(["bench"]) == OK
    said = capsys.readouterr().out
    assert all(f"\n{name} " in said for name in benchmarks.BENCHMARKS)


def test_what_follows_the_name_is_the_benchmarks_own(monkeypatch: pytest.MonkeyPatch, tmp_path):
    ran: list[tuple[list[str], Path]] = []

    def run(command: list[str], cwd: Path, env: dict[str, str]) -> SimpleNamespace:
        assert env["PYTHONPATH"].startswith(str(ROOT))
        ran.append((command, cwd))
        return SimpleNamespace(returncode=7)

    monkeypatch.setattr(benchmarks.subprocess, "run", run)
    monkeypatch.chdir(tmp_path)
    assert main(["bench", "throughput", "--parts", "slopes", "-x", "--help"]) == 7
    ((command, cwd),) = ran
    assert command[1:3] == ["-m", "benchmarks.throughput"]
    assert command[3:] == ["--parts", "slopes", "-x", "--help"]
    assert cwd == ROOT


def test_outside_a_checkout_it_says_what_to_do(capsys, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(benchmarks, "checkout", lambda: None)
    assert main(["bench", "throughput"]) == WRONG_INPUT
    said = capsys.readouterr().err
    assert "needs a checkout of the project" in said
    assert "pip install -e .[bench]" in said
    assert main(["bench"]) == OK
    assert "The others need a checkout" in capsys.readouterr().out


def test_one_of_the_package_tells_what_it_found(capsys):
    assert main(["bench", "optimisers", "methods", "--json"]) == OK
    told = json.loads(capsys.readouterr().out)
    assert "`slsqp`" in [row["method"] for row in told["methods"]]
    assert main(["bench", "--json", "optimisers", "report", "nowhere.csv", "--out", "x"]) == 2
    assert capsys.readouterr().out == ""
