"""The one bar that methods, trainings and films share."""

import io
import sys

import pytest

from stickslip.optim.progress import Bar


def through(shown: bool, **how) -> str:
    to = io.StringIO()
    with Bar("training", 40, "step", shown, to=to, **how) as bar:
        bar.advance(10, "quick")
        bar.say("an evaluation")
        bar.advance(10)
    return to.getvalue()


def test_a_bar_says_what_it_counts_and_goes():
    pytest.importorskip("tqdm")
    said = through(True, at=20)
    assert "training:  50%" in said  # what is there already counts
    assert "quick" in said
    assert said.count("an evaluation\n") == 1
    assert said.rsplit("\r", 1)[1].strip() == ""


def test_without_a_bar_lines_are_still_said(monkeypatch):
    assert through(False) == "an evaluation\n"
    monkeypatch.setitem(sys.modules, "tqdm", None)
    assert through(True) == "an evaluation\n"
