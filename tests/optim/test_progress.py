"""The one bar that methods, trainings and films share."""

import io
import sys

import pytest

from stickslip.optim import progress
from stickslip.optim.progress import Bar


class Terminal(io.StringIO):
    """Says that it is one."""

    def isatty(self) -> bool:
        return True


def through(shown: bool, to: io.StringIO | None = None, **how) -> str:
    to = Terminal() if to is None else to
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


def test_elsewhere_there_is_a_line_now_and_then(monkeypatch):
    assert through(True, io.StringIO()) == "an evaluation\n"  # soon done: no line of its own
    monkeypatch.setattr(progress, "EVERY", 0.0)
    first, said, last = through(True, io.StringIO(), at=20).splitlines()
    assert first.startswith("training: 30 of 40 steps, ")
    assert (said, last[:25]) == ("an evaluation", "training: 40 of 40 steps,")
    assert through(True, io.StringIO(), lines=False) == "an evaluation\n"
    assert through(False, io.StringIO()) == "an evaluation\n"


def test_without_a_bar_lines_are_still_said(monkeypatch):
    assert through(False) == "an evaluation\n"
    monkeypatch.setitem(sys.modules, "tqdm", None)
    assert through(True) == "an evaluation\n"
