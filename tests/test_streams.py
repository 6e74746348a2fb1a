"""Commands end as they should where standard output or error is not what one expects."""

import io
import os
import subprocess
import sys

import pytest

from stickslip import cli
from stickslip.commands import OK, READER_LEFT, WRONG_INPUT

COMMAND = [sys.executable, "-m", "stickslip.cli"]


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_table_is_printed_with_the_letters_that_there_are(monkeypatch, encoding):
    written = io.BytesIO()
    with io.TextIOWrapper(written, encoding=encoding) as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        assert cli.main(["policies"]) == OK
        stream.flush()
        assert "biped-ice" in written.getvalue().decode(encoding)


def test_errors_of_a_closed_standard_error_are_not_printed_on_the_other(capsys, monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    assert cli.main(["evaluate", "nosuch"]) == WRONG_INPUT
    sys.stderr.close()
    assert capsys.readouterr().out == ""


def test_a_closed_standard_output_leaves_the_other_alone(capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    assert cli.main(["policies"]) == OK
    sys.stdout.close()
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("words", [["tasks"], ["--version"]], ids=["a table", "one line"])
def test_a_reader_that_leaves_is_no_wrong_input(words):
    if sys.platform == "win32":
        pytest.skip("pipes break otherwise on Windows")
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=plain
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait(60) == READER_LEFT
