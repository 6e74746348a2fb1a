"""Columns of what no drive can beat, beside those that there are."""

from __future__ import annotations

from stickslip.agents.registry import machine_by_name
from stickslip.cli import WRONG_INPUT, main
from stickslip.envs import task_by_name

UGV = machine_by_name("ugv")


def test_a_named_task_has_the_columns_of_the_bound_without_those_of_the_grid():
    env = task_by_name("UGVBump-v1").make()[0]
    found = UGV.measures(env, task=True, bound=True)
    assert {"bound", "over_bound"} <= found.columns.keys()
    assert not {"optimum", "score"} & found.columns.keys()
    assert found.complete is not None


def test_nothing_is_proved_of_what_the_biped_earns_in_an_episode(capsys):
    assert main(["evaluate", "--bound", "constant-torque"]) == WRONG_INPUT
    assert "nobody has proved what no policy of the biped" in capsys.readouterr().err
