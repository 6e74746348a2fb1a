"""The command `sweep` from its flags to its files."""

import json

import numpy as np
import pytest

from stickslip.agents import read_sweep, sweep_arrays
from stickslip.cli import OK, main
from tests.agents.mass import MassMachine
from tests.agents.sweeps.masses import StillEnv
from tests.asked import prints, refusal

pytestmark = pytest.mark.usefixtures("empty_directory")

SWEEP = ["sweep", "mass", "--policy", "pull", "--episodes", "3"]
AXES = ["--axis", "mu=0.1:0.3:3", "--axis", "task.mass=1,2"]


def test_a_sweep_is_one_command_and_goes_on_with_another(tmp_path, capsys):
    assert main([*SWEEP, *AXES, "--out", "a", "--json"]) == OK
    told, shown = (text for text in capsys.readouterr())
    (row,) = json.loads(told)["summary"]
    assert (row["policy"], row["points"], row["episodes"], row["failures"]) == ("pull", 6, 18, 0)
    returns = np.asarray(read_sweep("a")["reward"])
    assert row["return_mean"] == pytest.approx(returns.mean(), rel=1e-5)
    assert returns.min() < row["point_mean_least"] < row["return_mean"] < row["point_mean_most"]
    assert {one.name for one in (tmp_path / "a").iterdir()} == {"sweep.json", "data", "sweep.png"}
    assert "--resume to continue" in refusal(capsys, *SWEEP, *AXES, "--out", "a")
    shown = prints(capsys, *SWEEP, *AXES, "--out", "a", "--resume", "--no-pictures")
    assert "18 episodes of up to 30 steps: 1 cases (policy on task) x 6 points x 3 ep" in shown
    assert "mu: 3 values, 0.1 to 0.3, in place of the task's task.mu" in shown
    assert "Played 0 of 1 cells" in shown


def test_one_episode_is_enough_where_no_reset_draws(capsys, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(MassMachine, "env", lambda self: StillEnv())
    who = ["sweep", "mass", "--policy", "pull", "--axis", "mu=0.1:0.3:3", "--episodes", "5"]
    assert main([*who, "--out", "a", "--no-pictures"]) == OK
    assert "1 episode a point, not 5: no reset draws anything" in capsys.readouterr().out
    assert sweep_arrays("a").random == ()
