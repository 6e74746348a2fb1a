"""rl-zoo3 trains with the settings of docs/rl_zoo3.yml."""

from __future__ import annotations

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
