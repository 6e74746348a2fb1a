"""What a shell completes: asked of bash itself, and of the program as any shell asks it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stickslip.cli import OK, WRONG_INPUT, main
from stickslip.completing import SHELLS

pytest.importorskip("argcomplete")
PROGRAM = f'#!/bin/sh\nexec "{sys.executable}" -m stickslip.cli "$@"\n'
ASK = """
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


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes_commands_flags_and_names(tmp_path: Path):
    program = tmp_path / "stickslip"
    program.write_text(PROGRAM)
    program.chmod(0o755)
    found = os.pathsep.join(filter(None, sys.path))
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": found}
    asked = "\n".join(f'ask "{line}"' for line in LINES)
    ran = subprocess.run(
        ["bash", "--norc", "-c", ASK + asked],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        env=environment,
        check=False,
    )
    answers = [{word.strip("'") for word in one.split()} for one in ran.stdout.splitlines()]
    assert dict(zip(LINES, answers, strict=True)) == LINES, ran.stderr


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_has_a_script_that_asks_the_program(capsys, shell: str):
    assert main(["completion", shell]) == OK
    said = capsys.readouterr().out
    assert "_ARGCOMPLETE" in said
    assert "stickslip" in said


def test_an_unknown_shell_is_refused(capsys):
    assert main(["completion", "tcl"]) == WRONG_INPUT
    assert "'bash', 'zsh', 'fish'" in capsys.readouterr().err


def test_where_argcomplete_is_missing_its_extra_is_named(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "argcomplete", None)
    assert main(["completion", "bash"]) == WRONG_INPUT
    assert 'pip install "stickslip[completion]"' in capsys.readouterr().err
