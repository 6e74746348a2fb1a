"""What a training's page says of its run."""

from pathlib import Path

from stickslip.agents import TrainConfig, Trained
from stickslip.agents.reports.trained import _settings, _steps_in_words


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
