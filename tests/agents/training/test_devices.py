"""Learning on several devices and in several processes: the same curve, and one directory."""

import json
import os
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.training import processes
from stickslip.agents.training.devices import mesh_for
from stickslip.agents.training.metrics import read_columns
from tests.agents.runs import TIMED

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
DEVICES = "--xla_force_host_platform_device_count="


def begun(script: str, *arguments: str, devices: int = 1) -> subprocess.Popen:
    """A script of this folder in a process with so many devices."""
    flags = f"{os.environ.get('XLA_FLAGS', '')} {DEVICES}{devices}"
    return subprocess.Popen(
        [sys.executable, str(HERE / script), *arguments],
        env={**os.environ, "XLA_FLAGS": flags, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def finished(process: subprocess.Popen) -> str:
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err[-3000:]
    return out


def test_the_curve_is_the_same_on_one_two_and_four_devices():
    found = json.loads(finished(begun("several.py", devices=4)))
    for devices in ("1", "2", "4"):
        assert found[devices]["on"] == int(devices)
    assert found["1"]["curve"][-1]["ended"] == 0 < found["1"]["curve"][1]["ended"]
    for devices in ("2", "4"):
        for row, other in zip(found[devices]["curve"], found["1"]["curve"], strict=True):
            assert row == pytest.approx(other, rel=1e-3, abs=1e-5)
        np.testing.assert_allclose(found[devices]["weights"], found["1"]["weights"], atol=2e-5)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((2, 8, 32), "devices = 2; accepted: 1 to 1, the devices of this process .on a processor"),
        ((0, 8, 32), "devices = 0"),
        (("many", 8, 32), "devices = 'many'"),
    ],
)
def test_devices_that_are_none_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        mesh_for(*given)


def test_one_device_of_one_process_is_no_mesh():
    assert mesh_for(None, 7, 3) is None
    assert mesh_for(1, 7, 3) is None


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ((None, 0, None), "without coordinator"),
        (("here", 0, 2), "coordinator = 'here'"),
        (("127.0.0.1:70000", 0, 2), "coordinator = '127.0.0.1:70000'"),
        (("127.0.0.1:7000", 0, None), "--process 0 --processes 2"),
        (("127.0.0.1:7000", 2, 2), "process = 2"),
        (("auto", 0, 2), "'auto' alone"),
    ],
)
def test_processes_that_do_not_go_together_are_refused(given, words):
    with pytest.raises(ValueError, match=words):
        processes.join(*given)


def together(path: Path, *, fails: bool = False, devices: int = 1) -> list[str]:
    """What two processes say that train in a directory."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    pair = [
        begun("together.py", str(path), f"127.0.0.1:{port}", f"{one}", devices=devices)
        for one in range(2)
    ]
    ends = [process.communicate(timeout=300) for process in pair]
    assert [process.returncode for process in pair] == [fails, fails], ends
    return [err if fails else out for out, err in ends]


@pytest.mark.long
def test_two_processes_learn_what_one_does_and_the_first_one_writes(tmp_path):
    """Stopped in the second process, resumed, and in one process to the end."""
    finished(begun("together.py", str(tmp_path / "one")))
    first = together(tmp_path / "two")
    assert "stopped at 256" in first[0]
    assert "stopped at 256" in first[1]
    again = together(tmp_path / "two", devices=2)
    assert "finished at 512" in again[0]
    assert "finished at 512" in again[1]
    for name in ("metrics.csv", "evaluations.csv"):
        one, two = (read_columns(tmp_path / path / name) for path in ("one", "two"))
        for column in one.keys() - TIMED:
            np.testing.assert_allclose(one[column], two[column], rtol=1e-3, atol=1e-5)
    assert "the first process" in together(tmp_path / "two" / "config.json", fails=True)[1]
