"""The configuration of a training run and the table of its metrics."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from stickslip.agents.biped.config import DEFAULTS, TrainConfig
from stickslip.agents.registry import read_configuration
from stickslip.agents.training.command_line import from_flags
from stickslip.agents.training.configuration import (
    Configuration,
    every_field,
)
from stickslip.agents.training.groups import PPOSettings
from stickslip.agents.training.metrics import MetricsFile, read_columns, read_rows
from stickslip.agents.ugv.config import UGVTrainConfig
from stickslip.flags import add_fields
from stickslip.parser import Parser


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("algorithm", "dqn"),
        ("timesteps", 0),
        ("timesteps", 1.5),
        ("timesteps", True),
        ("learning_rate", math.nan),
        ("learning_rate", 0.0),
        ("learning_rate", "fast"),
        ("noise", -0.1),
        ("noise", math.inf),
        ("discount", 1.01),
        ("mu_static", -0.1),
        ("payload", math.inf),
        ("commanded_rate", 0.0),
        ("random_mass", (2.0, 1.0)),
        ("random_mass", (0.0, 1.0)),
        ("random_friction", (0.5, math.nan)),
        ("random_friction", 0.5),
        ("see_patch", 1),
        ("seed", -1),
        ("batch_size", 100),
        ("batch_size", 65536),
        ("mu_kinetic", 0.05),
    ],
)
def test_a_bad_value_is_refused_by_name(name: str, value):
    with pytest.raises(ValueError, match=rf"^{name} = .*; accepted: "):
        TrainConfig.of(**{name: value})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"scene": "ice"}, r"scene = 'ice' is unknown; .*did you mean ice-patch\?"),
        ({"scene": "grip", "random_friction": (0.5, 1.0)}, r"random_friction = .* 'grip'"),
        ({"algorithm": "sac", "trainer": "sb3", "batch_size": 10**9}, "batch_size = 1000000000 "),
        ({"mu_static": 0.1, "mu_kinetic": 0.3}, r"mu_kinetic = 0\.3 exceeds mu_static = 0\.1"),
    ],
)
def test_what_no_run_could_start_with_is_refused_when_it_is_built(given: dict, message: str):
    with pytest.raises(ValueError, match=message):
        TrainConfig(**given)
    with pytest.raises(ValueError, match=message):
        replace(TrainConfig(), **given)


def test_an_unknown_field_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"'lerning_rate' is no field; accepted: .*learning_rate"):
        TrainConfig.of(lerning_rate=1e-3)


@pytest.mark.parametrize("algorithm", DEFAULTS)
def test_a_configuration_survives_its_json(algorithm: str):
    config = TrainConfig.of(algorithm=algorithm, random_friction=(0.8, 1.2), payload=2.0)
    again = TrainConfig.from_json(config.to_json())
    assert again == config
    assert again.digest == config.digest
    assert TrainConfig.of(algorithm=algorithm).digest != config.digest


EARLIER = Path(__file__).parents[2] / "reference" / "configurations"
"""As training wrote them when every field stood by its name, without groups."""


@pytest.mark.parametrize(
    ("name", "digest", "expected"),
    [
        ("biped_ppo", "96623cee458007e2", TrainConfig.of(trainer="sb3")),
        (
            "biped_sac",
            "66fbb1cea21e9f97",
            TrainConfig.of(algorithm="sac", random_friction=(0.8, 1.2)),
        ),
        ("ugv", "0ff36dfe9b57330e", UGVTrainConfig.of(trainer="sb3", epochs=3)),
    ],
)
def test_configurations_of_earlier_runs_are_read_and_their_checkpoints_still_belong_to_them(
    name: str, digest: str, expected: Configuration
):
    text = (EARLIER / f"{name}.json").read_text(encoding="utf-8")
    assert not {"ppo", "trainer"} & json.loads(text).keys()
    found = read_configuration(text)
    assert found == expected
    assert found.digest == expected.digest == digest
    assert read_configuration(found.to_json()) == found
    assert "trainer" not in json.loads(found.to_json())


def test_a_configuration_says_what_learns_where_it_is_not_what_always_did():
    for kind in (TrainConfig, UGVTrainConfig):
        config = kind.of()
        assert config == kind() == kind.of(trainer="jax")
        assert json.loads(config.to_json())["trainer"] == "jax"
        assert read_configuration(config.to_json()) == config
        assert config.digest != replace(config, trainer="sb3").digest
    assert TrainConfig.of(algorithm="sac").trainer == "sb3"
    assert TrainConfig.of(trainer="sb3", threads=2).threads == 2
    with pytest.raises(ValueError, match="trainer = 'jax' with algorithm = 'sac'; accepted: 'sb3'"):
        TrainConfig.of(algorithm="sac", trainer="jax")
    with pytest.raises(ValueError, match="threads with trainer = 'jax', which has none"):
        TrainConfig.of(threads=2)
    with pytest.raises(ValueError, match="trainer = 'torch' is unknown; accepted: 'jax', 'sb3'"):
        TrainConfig.of(trainer="torch")


def test_the_settings_of_an_algorithm_are_a_group_that_machines_share():
    for config in (TrainConfig.of(epochs=3, noise=0.5), UGVTrainConfig.of(epochs=3, noise=0.5)):
        assert isinstance(config.ppo, PPOSettings)
        assert (config.ppo.epochs, config.ppo.noise) == (3, 0.5)
        assert json.loads(config.to_json())["ppo"]["epochs"] == 3
    steps = replace(TrainConfig.of(), ppo=replace(TrainConfig.of().ppo, rollout_steps=64))
    assert steps == TrainConfig.of(rollout_steps=64)
    assert steps.digest != TrainConfig.of().digest
    with pytest.raises(ValueError, match=r"^ppo = 3; accepted: a PPOSettings"):
        replace(TrainConfig.of(), ppo=3)
    with pytest.raises(ValueError, match=r"^epochs = 0; accepted: an integer, >= 1"):
        PPOSettings(epochs=0)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"ppo": 3}, "ppo = 3 is no group"),
        ({"ppo": {"epochs": 3}}, "lacks rollout_steps"),
        ({"ppo": {"buffer_size": 3}}, "'buffer_size' is no field of ppo"),
        ({"epochs": 3}, "it has epochs twice"),
        ({"sac": {}}, "lacks buffer_size"),
    ],
)
def test_a_group_that_is_not_whole_is_refused(change: dict, reason: str):
    content = {**json.loads(TrainConfig.of().to_json()), **change}
    with pytest.raises(ValueError, match=reason):
        TrainConfig.from_json(json.dumps(content))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"format": "a recipe"}, "does not say"),
        ({"version": 99}, "version is 99"),
        ({"hidden": -1}, "hidden = -1"),
        ({"hiden": 1}, "'hiden' is no field"),
    ],
)
def test_foreign_json_is_refused(change: dict, reason: str):
    content = json.loads(TrainConfig.of().to_json()) | change
    with pytest.raises(ValueError, match=reason):
        TrainConfig.from_json(json.dumps(content))


@pytest.mark.parametrize("text", ["", "[]", "{", "null", '{"format": "stickslip training"}'])
def test_what_is_no_configuration_is_refused(text: str):
    with pytest.raises(ValueError):  # noqa: PT011  (whatever it says)
        TrainConfig.from_json(text)


def test_every_field_has_a_flag_or_a_setting():
    names = [one.name for one in every_field(TrainConfig)]
    parser = Parser()
    add_fields(parser, TrainConfig)
    flags = {one.dest for one in parser._actions} - {"help", "set"}
    assert flags == set(TrainConfig.FLAGS)
    assert [*parser.settings] == [name for name in names if name not in flags]
    assert from_flags(vars(parser.parse_args([])), TrainConfig) == TrainConfig.of()


def test_rows_past_the_checkpoint_and_torn_lines_are_dropped(tmp_path: Path):
    path = tmp_path / "table.csv"
    table = MetricsFile(path, ("a", "b"))
    for steps in (10, 20, 30):
        table.append(steps, {"a": steps / 7, "b": math.nan})
    with path.open("a") as file:
        file.write("40,1.")
    assert [row["timesteps"] for row in read_rows(path)] == ["10", "20", "30"]
    again = MetricsFile(path, ("a", "b"), upto=20)
    again.append(25, {"b": 1.0})
    found = read_columns(path)
    assert found["timesteps"] == [10, 20, 25]
    assert found["a"][:2] == pytest.approx([10 / 7, 20 / 7], rel=1e-6)
    assert math.isnan(found["a"][2])
    assert path.read_text().count("\n") == 4


def test_tensorboard_reads_the_log_and_hides_what_a_resumption_repeats(tmp_path: Path):
    accumulator = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    from stickslip.agents.training.tensorboard import TensorBoard

    for upto, offset in ((0, 0.0), (20, 0.5)):
        with TensorBoard(tmp_path, upto) as board:
            for steps in range(upto + 10, 50, 10):
                board.add("train", steps, {"loss": steps + offset, "unknown": math.nan})
    assert len(list(tmp_path.glob("events.out.tfevents.*"))) == 2
    found = accumulator.EventAccumulator(str(tmp_path)).Reload()
    assert found.Tags()["scalars"] == ["train/loss"]
    told = [(one.step, one.value) for one in found.Scalars("train/loss")]
    assert told == [(10, 10.0), (20, 20.0), (30, 30.5), (40, 40.5)]
