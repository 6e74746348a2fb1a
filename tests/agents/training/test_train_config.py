"""The configuration of a training run and the table of its metrics."""

import json
import math
import shlex
from dataclasses import fields, replace
from functools import partial
from pathlib import Path

import pytest

from stickslip.agents.biped.machine import TrainConfig
from stickslip.agents.machine import machine_by_name, read_configuration
from stickslip.agents.training.configuration import command_of, read_settings, settings_given
from stickslip.agents.training.directory import MetricsFile, read_columns
from stickslip.agents.ugv.machine import UGVTrainConfig
from stickslip.cli import make_parser
from stickslip.flags import add_fields
from stickslip.parser import Parser


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("learning_rate", math.nan),
        ("random_mass", (2.0, 1.0)),
        ("batch_size", 100),
        ("mu_kinetic", 0.05),
        ("scene", "ice"),
    ],
)
def test_a_bad_value_is_refused_by_name(name: str, value):
    for build in (TrainConfig.of, partial(replace, TrainConfig())):
        with pytest.raises(ValueError, match=rf"^{name} = .*; accepted: "):
            build(**{name: value})


def test_a_configuration_says_what_learns_where_it_is_not_what_always_did():
    for kind in (TrainConfig, UGVTrainConfig):
        config = kind.of()
        assert config == kind() == kind.of(trainer="jax")
        assert json.loads(config.to_json())["trainer"] == "jax"
        assert read_configuration(config.to_json()) == config
        assert config.digest != replace(config, trainer="sb3").digest
    with pytest.raises(ValueError, match="trainer = 'torch' is unknown; accepted: 'jax', 'sb3'"):
        TrainConfig.of(trainer="torch")


def test_a_file_without_a_field_has_its_default():
    content = json.loads(TrainConfig.of(epochs=3).to_json())
    del content["history"]
    assert TrainConfig.from_json(json.dumps(content)) == TrainConfig.of(epochs=3)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"buffer_size": 3}, "'buffer_size' is no field"),
        ({"history": 65}, "history = 65; accepted: an integer"),
        ({"format": "a recipe"}, "does not say"),
    ],
)
def test_foreign_json_is_refused(change: dict, reason: str):
    content = json.loads(TrainConfig.of().to_json()) | change
    with pytest.raises(ValueError, match=reason):
        TrainConfig.from_json(json.dumps(content))


@pytest.mark.parametrize(
    ("config", "said"),
    [
        (TrainConfig.of(), "stickslip train biped"),
        (
            TrainConfig.of(random_mass=(0.5, 1.25), see_patch=True, seed=3),
            "biped --seed 3 --out runs/it --set see_patch=true random_mass=0.5,1.25",
        ),
        (
            TrainConfig.of(task="BipedFast-v0", start_rate=5.0, learning_rate=1 / 3),
            "--task BipedFast-v0 --learning-rate 0.3333333333333333 --out runs/it --set start_rate",
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
    kind = machine_by_name(words[1]).configuration
    assert kind.of(**settings_given(given, kind)) == config


def given_in(*words: str):
    return TrainConfig.of(**settings_given(vars(make_parser(words).parse_args(words)), TrainConfig))


@pytest.mark.parametrize(
    "config",
    [
        TrainConfig.of(trainer="sb3", random_mass=(0.5, 1.25)),
        TrainConfig.of(task="BipedFast-v0", start_rate=5.0, epochs=3),
    ],
)
def test_the_config_of_a_run_and_a_toml_file_give_settings(tmp_path, config):
    run, words = tmp_path / "config.json", ["train", "biped", "--config"]
    run.write_text(config.to_json())
    assert given_in(*words, str(run)) == config
    assert given_in(*words, str(run), "--seed", "3") == replace(config, seed=3)
    mine = tmp_path / "mine.toml"
    mine.write_text('machine = "biped"\nseed = 3\nrandom_mass = [0.5, 1.25]\nepochs = 3\n')
    found = TrainConfig.of(seed=3, random_mass=(0.5, 1.25), epochs=5)
    assert given_in(*words, str(mine), "--set", "epochs=5") == found


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("a.toml", "sed = 1", "'sed' is no field; accepted: .*did you mean seed"),
        ("a.toml", "[ppo]\nepochs = 3", "'ppo' is no field"),
        ("a.json", UGVTrainConfig.of().to_json(), "it is of the 'ugv', not of the biped"),
    ],
)
def test_a_file_of_no_settings_is_refused_by_its_name(tmp_path, name, text, reason):
    (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=rf"{name}: {reason}.*; accepted: a TOML file of settings"):
        read_settings(tmp_path / name, TrainConfig)


def test_every_field_has_a_flag_or_a_setting():
    names = [one.name for one in fields(TrainConfig)]
    parser = Parser()
    add_fields(parser, TrainConfig)
    flags = {one.dest for one in parser._actions} - {"help", "set"}
    assert flags == set(TrainConfig.FLAGS)
    assert [*parser.settings] == [name for name in names if name not in flags]
    given = settings_given(vars(parser.parse_args([])), TrainConfig)
    assert TrainConfig.of(**given) == TrainConfig.of()


def test_rows_past_the_checkpoint_and_torn_lines_are_dropped(tmp_path: Path):
    path = tmp_path / "table.csv"
    table = MetricsFile(path, ("a", "b"))
    for steps in (10, 20, 30):
        table.append(steps, {"a": steps / 7, "b": math.nan})
    with path.open("a") as file:
        file.write("40,1.")
    assert read_columns(path)["timesteps"] == [10, 20, 30]
    MetricsFile(path, ("a", "b"), upto=20).append(25, {"b": 1.0})
    found = read_columns(path)
    assert found["timesteps"] == [10, 20, 25]
    assert found["a"][:2] == pytest.approx([10 / 7, 20 / 7], rel=1e-6)
    assert math.isnan(found["a"][2])
    assert path.read_text().count("\n") == 4
