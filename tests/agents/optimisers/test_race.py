"""Races: what goes wrong is recorded and the others go on; what is killed goes on as it was."""

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.optimisers import race
from stickslip.agents.optimisers.report import counted_text, read_results
from stickslip.records.signals import StoppedError
from tests.agents.optimisers import users
from tests.agents.optimisers.table import NAME

pytest.importorskip("pyarrow")
pytest.importorskip("cloudpickle")
fcntl = pytest.importorskip("fcntl")


def test_what_goes_wrong_is_recorded_and_the_others_go_on():
    outcomes = {
        "forks": "spent",
        "raises": "raised",
        "exits": "raised",
        "gives_nan": "spent",
        "goes_outside": "ended",
        "hides_the_end": "spent",
        "gives_up": "ended",
        "searches": "spent",
    }
    given = {name: getattr(users, name) for name in outcomes}
    found = race(given, NAME, budget=40, seeds=1, workers=1)
    runs = {run.method: run for run in found}
    assert {name: run.outcome for name, run in runs.items()} == outcomes
    assert runs["raises"].message == "RuntimeError: no luck"
    assert runs["exits"].message == "SystemExit: 3"
    assert runs["gives_nan"].counts["not_numbers"] >= 40
    assert runs["goes_outside"].counts["clipped"] == 1
    assert runs["searches"].counts["values"] == runs["searches"].evaluations[-1] == 40


RACE = f"""
import sys
from stickslip.agents.optimisers import race
from tests.agents.optimisers import users
race({{"slow": users.is_slow}}, ["{NAME}"], budget=5, seeds=4, workers=1, out=sys.argv[1])
"""


GIVEN = {"instances": [NAME], "budget": 5, "seeds": 1, "workers": 1}


@pytest.mark.long
@pytest.mark.usefixtures("empty_directory")
def test_a_process_that_ends_is_said_and_the_race_goes_on_and_leaves_none():
    given = {one.__name__: one for one in (users.dies, users.leaves_a_process, users.gives_up)}
    runs = race(given, **GIVEN, out="race")
    assert [run.outcome for run in runs] == ["died", "ended", "ended"]
    assert np.isnan(runs[0].best)
    assert len(read_results("race")) == 3
    assert "1 died" in counted_text(runs)
    time.sleep(1)
    with open("held") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)  # whoever had it is gone


def test_a_run_is_killed_at_its_limit():
    (run,) = race({"sleeps": users.sleeps}, **GIVEN, limit=2.0)
    assert (run.outcome, run.message) == ("timed out", "2 s with start and compiling")
    assert f"- sleeps on {NAME}, seed 0: timed out, 2 s" in counted_text([run])
    assert multiprocessing.active_children() == []


@pytest.mark.long
def test_a_race_is_stopped_within_a_run(tmp_path):
    began = time.monotonic()
    with pytest.raises(StoppedError):
        race({"sleeps": users.sleeps}, **GIVEN, stop=lambda: time.monotonic() > began + 5)
    assert time.monotonic() < began + 60


@pytest.mark.long
def test_a_race_that_is_killed_goes_on_with_what_is_missing(tmp_path):
    path = tmp_path / "race"
    paths = os.pathsep.join([str(Path(__file__).parents[3]), *filter(None, sys.path)])
    env = os.environ | {"PYTHONPATH": paths, "JAX_PLATFORMS": "cpu"}
    process = subprocess.Popen([sys.executable, "-c", RACE, str(path)], env=env)
    until = time.monotonic() + 120
    while len(kept := sorted(path.glob("data/cell-*"))) < 2:
        assert time.monotonic() < until
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    before = {one: one.stat().st_mtime_ns for one in kept}
    (path / "data" / ".cell-000003.parquet-0a1b2c3d.part").write_bytes(b"half")
    assert 2 <= len(read_results(path)) < 4
    given = {"methods": {"slow": users.is_slow}, "instances": [NAME], "workers": 1, "out": path}
    another = "begun with another definition: budget 5, not 6; accepted: to resume without"
    with pytest.raises(ValueError, match=another):
        race(**given, budget=6, seeds=4, resume=True)
    runs = race(**given, budget=5, seeds=4, resume=True)
    assert [run.seed for run in runs] == list(range(4))
    assert all(run.outcome == "ended" for run in runs)
    assert {one: one.stat().st_mtime_ns for one in kept} == before
    assert len(list((path / "data").iterdir())) == 4


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"budget": None}, "neither budget nor seconds"),
        ({"instances": ["gait-time-d17-v2"]}, "is unknown .did you mean gait-time-d1"),
        ({"instances": [NAME, NAME]}, "one or more, once"),
        ({"methods": {}}, "methods: none"),
        ({"methods": {"cma": users.gives_up}}, "a name of your own"),
        ({"methods": ["dp"]}, "takes posture, not gait"),
        ({"resume": True}, "resume without out"),
    ],
)
def test_bad_input_is_named_before_anything_runs(changed, words):
    usual = {"methods": ["random"], "instances": [NAME], "budget": 5}
    with pytest.raises(ValueError, match=words):
        race(**(usual | changed))
