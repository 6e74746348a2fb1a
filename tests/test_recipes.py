"""The programs of docs/training.md run as printed, with fewer steps."""

import re
from pathlib import Path

import numpy as np
import pytest

from tests.extras import SB3

PAGE = Path(__file__).parents[1] / "docs" / "training.md"
RECIPES = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), re.DOTALL | re.M)
FEWER = {
    "total_timesteps=500_000": "total_timesteps=2_048",
    " timesteps=1_000_000": " timesteps=8_192",
    "range(60)": "range(2)",
}
MOST_LINES = 24
"""Without empty ones; about fifteen without imports."""


def run(*codes: str) -> dict:
    """The names that programs leave, one continuing the other."""
    names: dict = {"__name__": "recipe"}
    for code in codes:
        for much, little in FEWER.items():
            code = code.replace(much, little)
        exec(compile(code, str(PAGE), "exec"), names)
    return names


def recipe(word: str) -> str:
    """The only one with a word in it."""
    (found,) = (code for code in RECIPES if word in code)
    return found


def test_every_number_of_steps_is_made_less_and_no_program_is_long():
    assert len(RECIPES) == 4
    text = "".join(RECIPES)
    assert [text.count(much) for much in FEWER] == [1] * len(FEWER)
    for code in RECIPES:
        lines = [line for line in code.splitlines() if line.strip()]
        assert len(lines) <= MOST_LINES


@pytest.mark.long
@SB3
def test_training_with_stable_baselines3(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    names = run(recipe("stable_baselines3"))
    assert names["model"].num_timesteps == 2_048
    assert "by hand" in capsys.readouterr().out


def test_a_loop_of_ones_own_goes_where_more_is_earned(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = run(recipe("def improved"))
    assert np.isfinite(names["mean"])
    assert names["weights"].shape == (1, 7)
    assert np.abs(names["weights"]).max() > 0.0


def test_a_reward_and_a_scene_of_ones_own_and_what_becomes_of_the_policy(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    names = run(recipe("class Gentle"), recipe("film("))
    env, params, policy = (names[one] for one in ("env", "params", "policy"))
    np.testing.assert_allclose(names["x"], policy(np.zeros(8, np.float32)), atol=1e-6)
    assert (tmp_path / "gentle.gif").stat().st_size > 10_000
    assert "mine" in capsys.readouterr().out
    found = names["found"].losses["return"]
    assert found.shape == (2, 1)
    assert env.observation_bounds(params)[0].shape == (8,)
