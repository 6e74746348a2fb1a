"""What is known of the tasks is what their policies earn."""

from __future__ import annotations

import pytest

from stickslip.agents import Idle, evaluate_task
from stickslip.agents.registry import machine_by_name
from stickslip.envs import TASKS, known_of


@pytest.mark.long
@pytest.mark.parametrize("name", TASKS)
def test_baselines_and_doing_nothing_earn_what_is_written_of_them(name):
    task = TASKS[name]
    known, machine = known_of(task), machine_by_name(task.machine)
    assert known is not None
    env = task.make()[0]
    who = {one.policy: machine.baseline(one.policy, env) for one in known.baselines}
    table = evaluate_task(name, {"idle": Idle(machine.outputs), **who})
    for earned in (known.trivial, *known.baselines):
        row = table.row(name, earned.policy)
        assert row.count == known.episodes
        # Falls decide whole episodes, and single precision differs from machine to machine.
        spread = 0.0 if earned.high is None else earned.high - earned.value
        assert row.metrics["return"].value == pytest.approx(
            earned.value, rel=0.01, abs=0.25 * spread
        )
