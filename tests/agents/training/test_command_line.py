"""A configuration's command asks for exactly that configuration."""

from __future__ import annotations

import shlex
from dataclasses import replace

import pytest

from stickslip.agents.biped.config import TrainConfig
from stickslip.agents.registry import machine_among
from stickslip.agents.training.command_line import command_of, from_flags, read_settings
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.cli import make_parser


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (TrainConfig.of(), "stickslip train biped"),
        (
            TrainConfig.of(seed=3, see_patch=True),
            "biped --seed 3 --out runs/it --set see_patch=true",
        ),
        (
            TrainConfig.of(algorithm="sac", buffer_size=1000),
            "--algorithm sac --out runs/it --set buffer_size=1000",
        ),
        (TrainConfig.of(trainer="sb3", hidden=32), "--trainer sb3 --out runs/it --set hidden=32"),
        (TrainConfig.of(random_mass=(0.5, 1.25)), "--set random_mass=0.5,1.25"),
        (TrainConfig.of(learning_rate=1 / 3), "--learning-rate 0.3333333333333333"),
        (
            TrainConfig.of(task="BipedFast-v0", start_rate=5.0, tracking_weight=1.0),
            "--task BipedFast-v0 --out runs/it --set start_rate=5 tracking_weight=1",
        ),
        (
            UGVTrainConfig.of(task="UGVBump-v1", failure=0.0, random_start=(30.0, 150.0)),
            "train --task UGVBump-v1 --out runs/it --set random_start=30,150 failure=0",
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


def given_in(*words: str):
    return from_flags(vars(make_parser(words).parse_args(words)), TrainConfig)


@pytest.mark.parametrize(
    "config",
    [
        TrainConfig.of(algorithm="sac", buffer_size=1000, random_mass=(0.5, 1.25)),
        TrainConfig.of(task="BipedFast-v0", start_rate=5.0, epochs=3),
    ],
)
def test_the_config_of_a_run_and_a_toml_file_give_settings(tmp_path, config):
    run, words = tmp_path / "config.json", ["train", "biped", "--config"]
    run.write_text(config.to_json())
    assert given_in(*words, str(run)) == config
    assert given_in(*words, str(run), "--seed", "3") == replace(config, seed=3)
    mine = tmp_path / "mine.toml"
    mine.write_text('machine = "biped"\nseed = 3\nrandom_mass = [0.5, 1.25]\n[ppo]\nepochs = 3\n')
    found = TrainConfig.of(seed=3, random_mass=(0.5, 1.25), epochs=5)
    assert given_in(*words, str(mine), "--set", "epochs=5") == found


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.toml", "seed = ", "it is damaged"),
        ("a.toml", "sed = 1", "'sed' is no field; accepted: .*did you mean seed"),
        ("a.toml", "[ppo]\nbuffer_size = 3", "'buffer_size' is no field of ppo"),
        ("a.toml", 'machine = "ugv"', "it is of the 'ugv', not of the biped"),
        ("a.json", "{}", "it does not say"),
        ("a.json", UGVTrainConfig.of().to_json(), "it is of the 'ugv', not of the biped"),
    ],
)
def test_a_file_of_no_settings_is_refused_by_its_name(tmp_path, name, text, reason):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=rf"{name}: {reason}.*; accepted: a TOML file of settings"):
        read_settings(tmp_path / name, TrainConfig)
