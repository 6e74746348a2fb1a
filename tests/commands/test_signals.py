"""Commands in processes of their own are asked to end: they stop, say how to go on, and do."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

START = """
import signal, sys
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, signal.default_int_handler)  # whoever runs the tests may ignore some
from stickslip.cli import main
sys.exit(main(sys.argv[1:]))
"""
TRAIN = "train biped --timesteps 50000000 --num-envs 128 --no-pictures"
SWEEP = "sweep biped --policy computed-torque --axis mu=0.05:0.3:4000 --episodes 8"
RACE = "bench run --instances shoot-grip-d10-v1 --methods random --seconds 3 --seeds 99"


def begun(command: str, out: Path) -> subprocess.Popen[str]:
    """The command, once there is something of it to go on from."""
    words = [*command.split(), "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-c", START, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    kept = ("**/checkpoints/[0-9]*", "**/*.parquet")
    while process.poll() is None and not any(any(out.glob(one)) for one in kept):
        time.sleep(0.1)
    return process


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "number"), [(TRAIN, signal.SIGTERM), (SWEEP, signal.SIGHUP), (RACE, signal.SIGTERM)]
)
def test_a_signal_to_all_processes_keeps_what_is_done_and_says_how_to_go_on(
    tmp_path: Path, command: str, number: int
):
    process = begun(command, tmp_path / "out")
    os.killpg(process.pid, number)
    said = process.communicate(timeout=120)[1]
    assert process.returncode == 128 + number, said
    assert "Stopping at the next step" in said
    assert "go on with" in said.splitlines()[-1]
    assert "--resume" in said.splitlines()[-1]
    assert "Traceback" not in said


@pytest.mark.long
def test_what_has_nothing_to_go_on_from_says_so_and_leaves_nothing(tmp_path: Path):
    process = subprocess.Popen(
        [sys.executable, "-c", START, "optimise", "ugv", "--out", str(tmp_path / "out")],
        stderr=subprocess.PIPE,
        text=True,
    )
    time.sleep(5)
    process.terminate()
    said = process.communicate(timeout=120)[1]
    assert process.returncode == 128 + signal.SIGTERM, said
    assert "interrupted by SIGTERM; the same command begins anew" in said
    assert not list(tmp_path.iterdir())
