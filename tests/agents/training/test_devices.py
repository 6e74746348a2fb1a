"""Learning on several devices: the same curve."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.training.learner import mesh_for

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


@pytest.mark.long
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


def test_one_device_is_no_mesh():
    assert mesh_for(None, 7, 3) is None
    assert mesh_for(1, 7, 3) is None
