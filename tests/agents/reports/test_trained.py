"""What a training's page says of its run."""

from pathlib import Path

import pytest

from stickslip.agents import TrainConfig, Trained, UGVTrainConfig
from stickslip.agents.registry import machine_by_name
from stickslip.agents.reports.trained import _curves, _scale, _settings, _steps_in_words, _units
from tests.agents.mass import MassConfig, MassMachine


def test_settings_are_those_that_the_run_went_by():
    own = dict(_settings(TrainConfig.of(mu_static=0.1)))
    assert own["mu_static"] == "0.1"
    assert own["commanded_rate"] == "3.0"
    assert own["ppo.clip_range"] == "0.2"
    assert not any(name.startswith(("sac", "shac", "payload")) for name in own)
    named = dict(_settings(TrainConfig.of(task="BipedFast-v0", algorithm="sac")))
    assert named["task"] == "BipedFast-v0"
    assert "commanded_rate" not in named  # the task says another one
    assert "sac.buffer_size" in named
    assert not any(name.startswith("ppo") for name in named)


def test_steps_are_counted_in_whole_updates():
    config = TrainConfig.of(timesteps=4096)
    for done, words in (
        (4096, "4,096 steps"),
        (32768, "32,768 steps, 4,096 asked for"),
        (2048, "2,048 of 4,096 steps"),
    ):
        trained = Trained(Path("run"), Path("policy.npz"), config, done, 1.0, done >= 4096)
        assert _steps_in_words(trained) == words


@pytest.mark.parametrize(
    ("machine", "config", "of"),
    [
        (
            machine_by_name("biped"),
            TrainConfig.of(),
            {"mean_crank_rate": "rad/s", "speed": "m/s", "energy_per_metre": "J/m", "falls": "%"},
        ),
        (
            machine_by_name("ugv"),
            UGVTrainConfig.of(criterion="peak_torque"),
            {"return": "N m", "cost": "N m", "wheel_energy": "J", "length": "steps"},
        ),
        (MassMachine(), MassConfig(), {"duration": "s", "failures": "%", "return": "-"}),
    ],
)
def test_columns_have_the_units_in_which_the_machine_measures(machine, config, of):
    units = _units(machine, machine.training_task(config))
    assert {name: units[name].unit for name in of} == of
    shares = {name: one.share for name, one in units.items() if one.share != 1}
    assert shares in ({"falls": 100.0}, {"failures": 100.0})


def test_curves_are_in_their_units_and_of_a_column_of_no_unit_in_none(tmp_path: Path):
    table = tmp_path / "metrics.csv"
    table.write_text("timesteps,return,falls,own\n10,1,0.25,7\n20,2,0.5,8\n")
    machine = machine_by_name("biped")
    units = _units(machine, machine.training_task(TrainConfig.of()))
    panels = [one.panel for one in _curves(table, ("return", "falls", "own"), "in t", units)]
    assert [(one.title, one.unit) for one in panels] == [
        ("return in t", "-"),
        ("falls in t", "%"),
        ("own in t", "-"),
    ]
    assert panels[1].lines[0].values.tolist() == [25.0, 50.0]


def test_the_reward_of_training_is_told_from_that_of_evaluations():
    ugv = machine_by_name("ugv").training_task(UGVTrainConfig.of(reward_scale=0.25))
    assert _scale(ugv) == pytest.approx(0.25)
    assert _scale(machine_by_name("biped").training_task(TrainConfig.of())) == 1
    assert _scale(MassMachine().training_task(MassConfig())) == 1
