"""A configuration's command asks for exactly that configuration."""

from __future__ import annotations

import shlex

import pytest

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.registry import machine_among
from stickslip.agents.training.command_line import command_of
from stickslip.agents.training.configuration import from_flags
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.cli import make_parser


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (TrainConfig.of(), "stickslip train biped"),
        (TrainConfig.of(seed=3, see_patch=True), "biped --seed 3 --see-patch"),
        (TrainConfig.of(algorithm="sac", buffer_size=1000), "--algorithm sac --buffer-size 1000"),
        (TrainConfig.of(trainer="sb3", hidden=32), "--trainer sb3 --hidden 32"),
        (TrainConfig.of(random_mass=(0.5, 1.25)), "--random-mass 0.5 1.25"),
        (TrainConfig.of(learning_rate=1 / 3), "--learning-rate 0.3333333333333333"),
        (
            TrainConfig.of(task="BipedFast-v0", start_rate=5.0, tracking_weight=1.0),
            "train --task BipedFast-v0 --start-rate 5 --tracking-weight 1",
        ),
        (
            UGVTrainConfig.of(task="UGVBump-v1", failure=0.0, random_start=(30.0, 150.0)),
            "train --task UGVBump-v1 --random-start 30 150 --failure 0",
        ),
        (UGVTrainConfig.of(tracks="my track.csv"), "ugv --tracks 'my track.csv'"),
    ],
)
def test_the_command_says_it_all(config, said: str):
    command = command_of(config, "runs/it")
    assert said in command
    words = shlex.split(command)[1:]
    given = vars(make_parser(words).parse_args(words))
    assert given["out"] == "runs/it"
    assert from_flags(given, machine_among(words).configuration) == config
