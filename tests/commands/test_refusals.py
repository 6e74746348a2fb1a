"""Wrong input to any command is refused in one line before anything is computed or written."""

import shlex
from pathlib import Path

import pytest

from tests.asked import refusal

SWEEP = "sweep biped --policy computed-torque"
DIRECTORY = "--out a.csv ends in '.csv'; accepted: a directory"
REFUSED = {
    "": "COMMAND",
    "dance": "invalid choice: 'dance'",
    "train biped --set epochs": "--set: 'epochs'; accepted: NAME=VALUE",
    "train biped --config nowhere.toml": "nowhere.toml: no such file",
    "train biped --resume --out nowhere": "nowhere holds no training run",
    "evaluate nobody": "'nobody' is neither a baseline nor a file; accepted: constant-torque",
    "evaluate computed-torque --scene icepatch": "did you mean ice-patch?",
    "train biped --out /dev/null": "/dev/null is a file",
    "evaluate /dev/zero": "not a plain file",
    "optimise ugv --track moon": "track 'moon' is neither a name nor a file; accepted: flat",
    "optimise ugv --track-option hight=1": "accepted: height, centre",
    "optimise ugv --set leg_rate=fast": "leg_rate: 'fast'; accepted: a number > 0, or none",
    "optimise ugv --seed 3": "--seed with --method dp; accepted: without it",
    "optimise biped --objective speed": "objective = 'speed' is unknown; accepted: 'time'",
    "optimise biped --objective time=": "accepted: a name, or name=weight",
    "optimise biped --set end=0": "end without --steps",
    "optimise biped --set reserve=1": "reserve = 1.0",
    "simulate biped --torque x": "'x' is unknown; accepted: arithmetic",
    "simulate biped --torque 1 --seconds 1e6 --period 1e-6": "makes 1e+12 rows",
    "simulate biped --torque 1 --out walk.txt": "accepted: .csv",
    "simulate biped --torque 1 --film walk.gif --seconds 700": "--film of 700 s; accepted: up to",
    "simulate biped --torque 1 --plot a.png --film a.png": "accepted: two files",
    "simulate biped --torque 1 --scene wet --mu-static 1": "both say which floor",
    "simulate biped --torque 1 --mu-static 1 2": "or --edges too",
    "simulate biped --torque 1 --edges 1": "--edges without --mu-static",
    "simulate biped --seconds 1": "accepted: one of --torque TORQUE and --rate RATE",
    "simulate biped --rate 3 --crank-rate 3": "--crank-rate with --rate",
    "simulate biped --rate fast": "rate 'fast'; accepted: a number [rad/s], or a .csv",
    "simulate ugv --angles 60 90 --posture a.csv": "one of --posture FILE and --angles",
    "simulate ugv --angles 60 200": "each from 30 to 150 degrees",
    "simulate ugv --posture .": "posture '.': no file stations.csv; accepted: stations.csv of",
    "simulate ugv --posture a.csv --set start=1": "start with --posture",
    "view computed-torque crank-speed-pi --out a.gif": "a.gif of 2 episodes; accepted: several in",
    f"view {'computed-torque ' * 9}--out a.html": "players = 9; accepted: 1 to",
    "reproduce fig11 --samples 3": "samples = 3; accepted: 24 to 2400",
    "simulate biped --torque 1 --torqe 1": "--torqe (did you mean --torque?)",
    "train biped --set timesteps=1": "--set timesteps is a flag; accepted: --timesteps VALUE",
    "simulate biped --torque 1 --phase 2": "accepted: --set phase=VALUE",
    "simulate biped --torque 1 --set phse=2": "did you mean phase",
    "optimise ugv --set start_angles=1": "'1'; accepted: 2 values with a comma",
    "optimise ugv --set overlap=yes": "'yes'; accepted: true, false",
    "evaluate computed-torque --set mu=wet": "--set mu=wet; accepted: a number",
    "evaluate --task BipedFast-v0 crank-speed-pi --scene wet": "--scene with --task BipedFast-v0",
    "evaluate --task BipedFast-v0 crank-speed-pi --set payload=1": "--set with --task BipedFast",
    "bench run --methods cme --budget 5 --out a": "did you mean cma",
    "view computed-torque --seconds nan": "seconds = nan",
    "train biped --set hidden=4096 layers=8": "what fits a policy file",
    "train biped --trainer sb3 --task BipedSprintSafe-v0": "trainer sb3 with a cost limit",
    "train biped --payload 1 --set random_payload=0,2": "payload with random_payload",
    "train biped --set random_mean_rate=4,5": "mean_rate = 3.0 outside random_mean_rate",
    "bench run --budget 0 --out a": "budget = 0",
    "tasks BipedFst-v0": "did you mean BipedFast-v0?",
    "bench report nowhere --out a": "nowhere/race.json: no such file",
    "train ugv --criterion speed": "criterion = 'speed' is unknown; accepted: 'wheel_energy'",
    "train ugv --tracks a.csv": "track 'a.csv' is neither a name nor a file; accepted: random-bump",
    "train ugv --set start_angle=20": ">= 30, <= 150",
    "evaluate computed-torque --set friction=1": "'friction' is no number of this task",
    "evaluate computed-torque --out a.csv": DIRECTORY,
    f"{SWEEP} --axis mu=0.1 --out a.csv": DIRECTORY,
    "train biped --out a.csv": DIRECTORY,
    "optimise ugv --out a.csv": DIRECTORY,
    f"{SWEEP} --out a --axis mu": "accepted: NAME=VALUES",
    f"{SWEEP} --out a --axis mu=1 --set payload=2": "no setting; accepted: bars.NAME, motor.NAME",
    f"{SWEEP} --out a --axis mu=1 --axis mu=2": "each name once",
    "sweep ugv --policy level-body --out a --task BipedSteady-v0": "accepted: tasks of the UGV",
    f"{SWEEP} --out a --task BipedSteady-v0 --scene wet": "--scene with --task",
}


@pytest.mark.parametrize("line", REFUSED)
def test_wrong_input_is_refused_in_one_line(capsys, tmp_path: Path, monkeypatch, line: str):
    monkeypatch.chdir(tmp_path)
    assert REFUSED[line] in refusal(capsys, *shlex.split(line))
    assert list(tmp_path.iterdir()) == []
