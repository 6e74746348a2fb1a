"""What commands of `stickslip` say, as tests ask for it."""

import json
import re
from typing import Any

import pytest

from stickslip.cli import OK, WRONG_INPUT, main


def prints(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = OK) -> str:
    """What a command prints, which ends with this status."""
    capsys.readouterr()
    assert main(arguments) == status
    return capsys.readouterr().out


def tells(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = OK) -> dict[str, Any]:
    """The object that a command tells with --json."""
    return json.loads(prints(capsys, *arguments, "--json", status=status))


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on stderr with which a command refuses."""
    capsys.readouterr()
    assert main(arguments) == WRONG_INPUT
    line = capsys.readouterr().err
    assert re.fullmatch(r"stickslip: error: [^\n]+\n", line)
    return line
