"""The pages about tasks and trainings hold what is known of them."""

import numpy as np
import pytest

from benchmarks import training
from benchmarks.report import put_between
from benchmarks.tasks import long_table
from stickslip.envs import TASKS, known_of
from tests.documents import ROOT

NAME = "BipedSteady-v0"


def test_the_page_has_the_table_of_what_is_known_and_shipped(tmp_path):
    page = (ROOT / "docs/tasks.md").read_text(encoding="utf-8")
    again = tmp_path / "page.md"
    again.write_text(page, encoding="utf-8")
    put_between(again, long_table(), "tasks")
    assert again.read_text(encoding="utf-8") == page


def test_the_time_to_the_goal_is_the_median_over_seeds_and_absent_where_most_miss_it():
    scale = known_of(TASKS[NAME]).scale

    def entry(*rows: list[float]) -> dict:
        returns = [[scale.zero + one * (scale.one - scale.zero) for one in row] for row in rows]
        return {"steps": [1e6, 2e6, 3e6], "processor_seconds": [1.0, 2.0, 3.0], "returns": returns}

    found = entry([0.1, 0.95, 0.8], [0.2, 0.92, 0.91], [0.3, 0.4, 0.96])
    np.testing.assert_allclose(training.scores(found, NAME)[0], [0.1, 0.95, 0.8])
    assert training.reached(found, NAME) == [1, 1, 2]
    cells = list(training.row(found, NAME).values())
    assert cells[:3] == ["3", "3 M", "3"]
    assert cells[3].startswith("0.89 ±")
    assert cells[4:] == ["3 of 3", "2 M", "2.0"]
    few = entry([0.1, 0.95, 0.8], [0.2, 0.3, 0.4])
    assert training.row(few, NAME)["after, steps"] == ""
    last = [row[-1] for row in few["returns"]]
    assert training.learned({**few, "steps": [3_000_000]})["returns"] == pytest.approx(last, 1e-5)
