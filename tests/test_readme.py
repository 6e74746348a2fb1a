"""The README's examples run as printed, and print what it shows."""

import re
from pathlib import Path

import jax
import numpy as np
import pytest

from tests.extras import SB3

README = Path(__file__).parents[1] / "README.md"
EXAMPLES = re.findall(
    r"```python\n(.*?)```\n(?:\n```text\n(.*?)```)?", README.read_text(encoding="utf-8"), re.DOTALL
)
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?(?![\w])")
NEAR = {"rtol": 0.02, "atol": 0.002}
"""Single precision, summed in another order on another machine."""
TRAINS = "model.learn("
DEAR = (TRAINS, "recommend(")


def example(code: str, shown: str, number: int):
    """Training takes a minute, and every setting that is told of is a program."""
    marks = [pytest.mark.long] if any(words in code for words in DEAR) else []
    marks += [SB3] if "stable_baselines3" in code else []
    return pytest.param(code, shown, id=str(number), marks=marks)


@pytest.mark.parametrize(
    ("code", "shown"), [example(*one, number) for number, one in enumerate(EXAMPLES)]
)
def test_the_example_runs_and_prints_what_is_shown(code, shown, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    precision = jax.config.read("jax_enable_x64")
    namespace = {"__name__": "example"}
    exec(compile(code, str(README), "exec"), namespace)
    assert jax.config.read("jax_enable_x64") == precision
    printed = capsys.readouterr().out
    assert words(printed) == words(shown)
    if TRAINS not in code:  # what is learnt differs from machine to machine
        np.testing.assert_allclose(numbers(printed), numbers(shown), **NEAR)


def words(text: str) -> list[str]:
    """A text without its numbers, spaces and rules."""
    return re.sub(r"[─\s]+", " ", NUMBER.sub("0", text)).split()


def numbers(text: str) -> list[float]:
    return [float(one) for one in NUMBER.findall(text)]


def test_every_example_shows_what_it_prints():
    assert EXAMPLES
    for code, shown in EXAMPLES:
        assert "print(" in code
        assert shown.strip()
