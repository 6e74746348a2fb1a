"""A request to end stops the work cleanly, whichever signal it comes as."""

import os
import pty
import signal
import sys
import time
from collections.abc import Iterator

import pytest

from stickslip.records.signals import ENDING, Interrupted, interruptible, stoppable


@pytest.fixture(autouse=True)
def _as_a_terminal_starts_it() -> Iterator[None]:
    """Whoever runs the tests may have had them ignored (nohup, a shell's background)."""
    before = {one: signal.signal(one, signal.SIG_DFL) for one in ENDING}
    yield
    for one, old in before.items():
        signal.signal(one, old)


@pytest.mark.parametrize("number", ENDING)
def test_a_signal_stops_the_work_and_a_second_one_ends_it_where_it_is_ctrl_c(capsys, number: int):
    with stoppable() as stop:
        assert not stop()
        signal.raise_signal(number)
        signal.raise_signal(signal.SIGTERM)
        assert stop()
        with pytest.raises(Interrupted):
            signal.raise_signal(signal.SIGINT)
    assert capsys.readouterr().err.count("Stopping at the next step") == 1
    assert stop.interrupted("go on").status == 128 + number
    assert all(signal.getsignal(one) == signal.SIG_DFL for one in ENDING)


class Asking:
    """Asks this process to end as it is forgotten, where Python drops exceptions."""

    def __del__(self) -> None:
        signal.raise_signal(signal.SIGTERM)


def test_a_signal_in_a_finaliser_is_not_lost():
    with interruptible():
        Asking()
        with pytest.raises(Interrupted):
            time.sleep(60)


def test_what_nohup_ignores_stays_ignored():
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with stoppable() as stop:
        signal.raise_signal(signal.SIGHUP)
    assert not stop()


def test_a_closed_terminal_is_written_to_no_more(monkeypatch: pytest.MonkeyPatch):
    ours, theirs = pty.openpty()
    with open(theirs, "w") as out, open(os.dup(theirs), "w") as err, stoppable() as stop:
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr(sys, "stderr", err)
        os.close(ours)
        signal.raise_signal(signal.SIGHUP)
        print("progress", flush=True)
        print("progress", file=sys.stderr, flush=True)
    assert stop()
