"""What a shell completes: asked of bash itself, where it is."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.flags import HOW

pytest.importorskip("argcomplete")
PROGRAM = f'#!/bin/sh\nexec "{sys.executable}" -m stickslip.cli "$@"\n'
BASH = """
source <(stickslip completion bash)
ask() {
    COMP_LINE="$1" COMP_POINT=${#1} COMP_TYPE=9 COMPREPLY=()
    $(complete -p stickslip | grep -o '_python_argcomplete') stickslip
    echo "${COMPREPLY[*]}"
}
"""
LINES = {
    "stickslip simu": {"simulate"},
    "stickslip evaluate --task BipedF": {"BipedFast-v0"},
    "stickslip view biped-ice": {"biped-ice", "biped-ice-seen"},
    "stickslip sweep ugv --policy biped-ice lev": {"level-body"},
    "stickslip simulate ugv --track b": {"bump"},
    "stickslip simulate ugv --ang": {"--angles"},
    "stickslip simulate biped --ang": set(),
    "stickslip bench thr": {"throughput"},
    "stickslip optimise biped --objective fr": {"friction"},
    "stickslip reproduce fig2": {"fig24", "fig25"},
    "stickslip evaluate 'biped-sl": {"biped-slippery"},
}


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files in it, and the command as a program of the path."""
    program = tmp_path / "bin/stickslip"
    program.parent.mkdir()
    program.write_text(PROGRAM)
    program.chmod(0o755)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    return tmp_path


@pytest.mark.usefixtures("there")
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_commands_flags_and_names():
    asked = "\n".join(f'ask "{line}"' for line in LINES)
    program = ["bash", "--norc", "-c", BASH + asked]
    ran = subprocess.run(program, capture_output=True, text=True, check=False)
    answers = [{word.strip("'") for word in one.split()} for one in ran.stdout.splitlines()]
    assert dict(zip(LINES, answers, strict=True)) == LINES, ran.stderr


@pytest.mark.parametrize("shell", HOW)
def test_every_shell_has_a_script_that_asks_the_program(capsys, shell: str):
    assert main(["completion", shell]) == OK
    said = capsys.readouterr().out
    assert "_ARGCOMPLETE" in said
    assert "stickslip" in said


def test_where_argcomplete_is_missing_its_extra_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "argcomplete", None)
    assert main(["completion", "bash"]) == WRONG_INPUT
    assert 'pip install "stickslip[completion]"' in capsys.readouterr().err
