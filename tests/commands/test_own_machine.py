"""Commands with a robot or a vehicle of the user: from a file, single numbers changed."""

import json

import pytest

from stickslip.agents.biped.task import swept, with_options
from stickslip.agents.protocol import Task
from stickslip.cli import main
from stickslip.dynamics.biped import BipedParams
from stickslip.dynamics.ugv import UGVParams
from stickslip.envs import task_by_name
from tests.asked import tells


def test_a_walk_of_the_robot_in_a_file(tmp_path, capsys):
    path = tmp_path / "my.toml"
    path.write_text('[bars]\ncrank_length = "60 mm"\n')
    walk = ["simulate", "biped", "--torque", "0", "--scene", "grip", "--seconds", "0.02", "--json"]
    masses = []
    for own in ([], ["--robot", str(path)], ["--robot", str(path), "--set", "robot.hip_mass=0.7"]):
        out = ["--out", str(tmp_path / f"{len(masses)}.csv")]
        main([*walk, *own, *out])
        json.loads(capsys.readouterr().out)
        masses.append((tmp_path / f"{len(masses)}.csv").read_text())
    assert masses[0] != masses[1] == masses[2]


def test_a_gait_keeps_its_robot_beside_it(tmp_path):
    path = tmp_path / "my.toml"
    path.write_text('[bars]\nhip_mass = "2 kg"\n[motor]\ntorque_limit = "3 N m"\n')
    gait = ["optimise", "biped", "--robot", str(path), "--no-pictures", "--set", "cells=40"]
    assert main([*gait, "bars.foot_mass=0.5", "--out", str(tmp_path / "gait")]) == 0
    kept = BipedParams.from_file(tmp_path / "gait" / "robot.toml")
    assert repr(kept) == repr(BipedParams.from_file(path, {"bars.foot_mass": 0.5}))
    found = json.loads((tmp_path / "gait" / "result.json").read_text())
    assert found["asked"]["torque_limit"] == 3.0


def test_a_drive_of_the_vehicle_in_a_file(tmp_path, capsys):
    path = UGVParams(wheel_radius=0.2).to_file(tmp_path / "my.toml")
    drive = ["simulate", "ugv", "--angles", "90", "90", "--set", "spacing=2", "--json"]
    drive += ["--vehicle", str(path), "--out", str(tmp_path / "drive.csv")]
    assert main([*drive, "--set", "vehicle.body_mass=100 kg"]) == 0
    assert json.loads(capsys.readouterr().out)["summary"][0]["status"] == "OK"


@pytest.mark.long
def test_a_policy_keeps_its_robot_and_is_tried_on_another(tmp_path, capsys):
    path = tmp_path / "my.toml"
    path.write_text('[bars]\nhip_mass = "2 kg"\n[motor]\ntorque_limit = "5 N m"\n')
    small = ["rollout_steps=16", "batch_size=64", "hidden=4"]
    small += ["evaluation_episodes=2", "robot.foot_mass=0.4"]
    train = ["train", "biped", "--robot", str(path), "--no-pictures"]
    train += ["--timesteps", "64", "--num-envs", "4", "--set", *small]
    assert main([*train, "--out", str(tmp_path / "run")]) == 0
    path.unlink()
    kept = json.loads((tmp_path / "run" / "config.json").read_text())["robot"]
    robot = BipedParams.from_file(kept)
    assert robot.mass[12] == 2.0
    assert robot.mass[0] == pytest.approx(0.4)
    evaluate = ["evaluate", str(tmp_path / "run"), "--episodes", "1"]
    labels = [
        tells(capsys, *evaluate, *words)["evaluation"][0]["scene"]
        for words in ([], ["--set", "robot.mass.hip=3"], ["--set", "robot.hip_mass=3"])
    ]
    assert labels == ["slippery, robot of 9.97 kg", *["slippery, robot of 11 kg"] * 2]


def test_a_sweep_of_another_robot_is_not_resumed(tmp_path, capsys):
    sweep = ["sweep", "biped", "--policy", "constant-torque", "--axis", "mu=0.1", "--episodes", "1"]
    sweep += ["--no-pictures", "--out", str(tmp_path / "sweep")]
    assert main([*sweep, "--set", "robot.hip_mass=2"]) == 0
    assert main([*sweep, "--resume"]) == 2
    assert main([*sweep, "--resume", "--set", "robot.hip_mass=2"]) == 0


def test_what_options_and_axes_set_of_a_task_that_draws_robots():
    task = Task(*task_by_name("BipedRobots-v0").make())
    given = {"robot": None, "start": None, "changes": {"robot.hip_mass": "2"}}
    given["numbers"] = {"payload": 1.0}
    params = with_options(task, given, None, viewed=False).params
    assert (params.randomisation.robot, params.randomisation.payload) == (None, None)
    assert float(params.robot.bare.mass[-1]) == 2.0
    assert float(swept().changed(task.params, {"mean_rate": 4.0}).mean_rate) == 4.0
    with pytest.raises(ValueError, match=r"'robot.crank_length' is no number of this task"):
        swept().changed(task.params, {"robot.crank_length": 0.03})
