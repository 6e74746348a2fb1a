"""Training runs side by side."""

from pathlib import Path

import numpy as np

from stickslip.agents import load_policy
from stickslip.agents.training.directory import list_checkpoints, read_columns
from tests.trees import assert_same

TINY = {
    "num_envs": 4,
    "rollout_steps": 32,
    "batch_size": 64,
    "epochs": 1,
    "hidden": 8,
    "evaluation_episodes": 1,
}
"""Fields of a training that takes seconds."""
TIMED = {"seconds", "steps_per_second"}
"""Columns that no two runs have alike."""


def assert_same_run(one: Path, other: Path):
    """The same policy to the last bit, the same numbers in the same rows."""
    assert_same(*(load_policy(path / "policy.npz") for path in (one, other)))
    for name in ("metrics.csv", "evaluations.csv"):
        left, right = read_columns(one / name), read_columns(other / name)
        assert left.keys() == right.keys()
        for column in left.keys() - TIMED:
            np.testing.assert_array_equal(left[column], right[column], err_msg=f"{name} {column}")
    names = [path.name for path in list_checkpoints(one / "checkpoints")]
    assert names == [path.name for path in list_checkpoints(other / "checkpoints")]
