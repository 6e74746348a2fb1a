"""Elsewhere than on a terminal, progress is lines, and not too many."""

import io

import pytest

from stickslip.agents.sweeps.playing import progress
from stickslip.optim import progress as bars


def test_a_line_now_and_then_says_how_far_it_is(monkeypatch: pytest.MonkeyPatch):
    now = iter([0.0, 4.0, 12.0, 13.0, 30.0])
    monkeypatch.setattr(bars.time, "monotonic", lambda: next(now))
    to = io.StringIO()
    with progress.Progress(1000, 100, True, to) as told:
        for _ in range(4):
            told.advance(180)
    assert to.getvalue().splitlines() == [
        "sweep: 460 of 1,000 episodes, 30 a second, about 0:18 to go",
        "sweep: 820 of 1,000 episodes, 24 a second, about 0:07 to go",
    ]


def test_nothing_is_said_where_nobody_asked():
    to = io.StringIO()
    with progress.Progress(10, 0, False, to) as told:
        told.advance(10)
    assert to.getvalue() == ""
