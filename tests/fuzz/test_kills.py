"""Trainings killed at any moment go on to the very policy of one that was not."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from stickslip.agents.training.directory import list_checkpoints
from tests.agents.runs import assert_same_run

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no SIGKILL here"),
]
KILLS = int(os.environ.get("STICKSLIP_KILLS", "5"))
"""Trainings, each killed at a random time."""
AGAIN = 0.25
"""Share of the resumptions that are killed."""
TRAIN = """
import sys
from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.training.run import train
small = dict(num_envs=4, hidden=8, evaluation_episodes=1, episode_time=0.4, seed=3)
few = dict(timesteps=4096, checkpoint_interval=128, rollout_steps=32, batch_size=64, epochs=1)
config = TrainConfig.of(trainer="jax", **small, **few)
train(config, sys.argv[1], bar=False, resume=sys.argv[2] == "resume")
"""


def started(path: Path) -> subprocess.Popen[str]:
    """A training, or its resumption where there is a run."""
    how = "resume" if (path / "config.json").exists() else "new"
    return subprocess.Popen(
        [sys.executable, "-c", TRAIN, str(path), how],
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )


def finish(path: Path) -> float:
    """Train to the end; return the seconds from the first checkpoint on."""
    process = started(path)
    while process.poll() is None and not (path / "checkpoints").is_dir():
        time.sleep(0.01)
    begun = time.monotonic()
    words = process.communicate()[1]
    assert process.returncode == 0, words
    return time.monotonic() - begun


def kill(path: Path, seconds: float) -> None:
    """Kill a training so long after it has begun to write."""
    process = started(path)
    written = len(list(path.rglob("*")))
    while process.poll() is None and len(list(path.rglob("*"))) == written:
        time.sleep(0.01)
    time.sleep(seconds)
    process.kill()
    words = process.communicate()[1]
    assert process.returncode in (0, -signal.SIGKILL), words


def test_a_training_killed_at_any_moment_ends_with_the_same_policy(tmp_path: Path):
    duration = finish(tmp_path / "whole")
    rng = np.random.default_rng(0)
    for number in range(KILLS):
        path = tmp_path / str(number)
        kill(path, rng.uniform(0, duration))
        while rng.random() < AGAIN:
            kill(path, rng.uniform(0, duration))
        steps = [one.name for one in list_checkpoints(path / "checkpoints")]
        print(f"\nkilled after {steps[-1] if steps else 'no'} steps")
        finish(path)
        assert_same_run(tmp_path / "whole", path)
        assert not list(path.rglob("*.part"))
