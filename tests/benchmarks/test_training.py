"""What the pages say of trainings that were measured."""

import numpy as np
import pytest

from benchmarks import training
from benchmarks.training import configuration, training_params
from stickslip.envs import task_by_name

NAME = "BipedSteady-v0"


def entry(*rows: list[float]) -> dict:
    """Three evaluations of each seed, as scores."""
    scale = training.scale_of(NAME)
    return {
        "steps": [1_000_000, 2_000_000, 3_000_000],
        "processor_seconds": [1.0, 2.0, 3.0],
        "returns": [[scale.zero + one * (scale.one - scale.zero) for one in row] for row in rows],
    }


def test_the_time_to_the_goal_is_the_middle_seeds_first_point_there():
    found = entry([0.1, 0.95, 0.8], [0.2, 0.92, 0.91], [0.3, 0.4, 0.96])
    np.testing.assert_allclose(training.scores(found, NAME)[0], [0.1, 0.95, 0.8])
    assert training.reached(found, NAME) == [1, 1, 2]
    text = training.body(
        {
            "tasks": {NAME: found},
            "machine": {"processor": "P", "cores": 2},
            "versions": {"jax": "1"},
            "commit": "c",
            "measured": "2026-01-01T",
        }
    )
    (row,) = (line for line in text.splitlines() if NAME in line)
    cells = [cell.strip() for cell in row.split("|")]
    assert cells[2:5] == ["3", "3 M", "3"]
    assert cells[5].startswith("0.89 ±")
    assert cells[6:9] == ["3 of 3", "2 M", "2.0"]


def test_without_most_of_the_seeds_there_is_no_time():
    found = entry([0.1, 0.95, 0.8], [0.2, 0.3, 0.4])
    assert training.reached(found, NAME) == [1]
    assert training.row(found, NAME)["after, steps"] == ""
    assert training.learned(found)["returns"] == pytest.approx(
        [row[-1] for row in found["returns"]], rel=1e-5
    )


@pytest.mark.parametrize("name", ["BipedSteady-v0", "BipedThrift-v0", "UGVRandomBumps-v1"])
def test_training_episodes_are_not_the_task_s_own(name: str):
    task = task_by_name(name)
    params, config = task.make("same_step")[1], configuration(task)
    assert (config.seed, config.trainer) == (0, "jax")
    assert training_params(task, params, config) != params
