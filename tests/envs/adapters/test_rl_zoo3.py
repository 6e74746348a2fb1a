"""rl-zoo3 trains with the settings of docs/rl_zoo3.yml."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

SETTINGS = Path(__file__).parents[3] / "docs" / "rl_zoo3.yml"


def test_its_settings_are_of_ids_that_gymnasium_knows():
    yaml = pytest.importorskip("yaml")
    import gymnasium

    import stickslip  # noqa: F401  (registers the environments)

    known = yaml.safe_load(SETTINGS.read_text(encoding="utf-8"))
    assert len(known) == 3
    for name, settings in known.items():
        assert gymnasium.spec(name) is not None
        assert settings["n_envs"] * settings["n_steps"] % settings["batch_size"] == 0


@pytest.mark.long
@pytest.mark.skipif(
    find_spec("rl_zoo3") is None,
    reason="rl-zoo3 wants python-dateutil below 3, constraints.txt has 4.0 (2026-11-23)",
)
def test_it_trains_and_leaves_a_model(tmp_path):
    command = [
        sys.executable,
        "-m",
        "rl_zoo3.train",
        "--algo",
        "ppo",
        "--gym-packages",
        "stickslip",
    ]
    command += ["--env", "stickslip/Biped-v0", "--conf-file", str(SETTINGS), "--device", "cpu"]
    command += ["--n-timesteps", "4096", "--eval-freq", "-1", "--log-folder", str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, cwd=tmp_path)
    assert list(tmp_path.rglob("stickslip-Biped-v0.zip"))
