"""What a shell completes: asked of bash, zsh and fish themselves, where they are."""

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
FISH = """
stickslip completion fish | source
function ask; echo (complete -C $argv | string split -f 1 \\t); end
"""
ZSH = """\
PS1= PROMPT_SP= zle_bracketed_paste=()
asked() { zle expand-or-complete; print -r -- "<<$BUFFER>>"; BUFFER= }
zle -N asked; bindkey '^I' asked; eval "$(stickslip completion zsh)"; echo '<<'begun'>>'
"""
ANSWER = "<<([^\r\n]*)>>"
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
FILES = {
    "stickslip simulate biped --torque wa": {"walk.csv"},
    "stickslip view walk.csv ru": {"runs/"},
    "stickslip evaluate runs/d": {"runs/demo/"},
}
"""Which the program leaves to bash and zsh."""


@pytest.fixture
def there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with files in it, and the command as a program of the path."""
    program = tmp_path / "bin/stickslip"
    (tmp_path / "runs/demo").mkdir(parents=True)
    program.parent.mkdir()
    program.write_text(PROGRAM)
    program.chmod(0o755)
    (tmp_path / "walk.csv").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("PATH", f"{program.parent}:{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
    return tmp_path


def shell(name: str, *options: str):
    """A test of a shell, where there is one."""
    missing = pytest.mark.skipif(shutil.which(name) is None, reason=f"no {name} here")
    return pytest.param([name, *options, "-c"], marks=missing, id=name)


@pytest.mark.usefixtures("there")
@pytest.mark.parametrize("command", [shell("bash", "--norc"), shell("fish", "--no-config")])
def test_the_shell_completes_commands_flags_and_names(command: list[str]):
    fish = command[0] == "fish"
    lines = LINES | FILES if fish else LINES
    asked = "\n".join(f'ask "{line}"' for line in lines)
    program = [*command, (FISH if fish else BASH) + asked]
    ran = subprocess.run(program, capture_output=True, text=True, check=False)
    answers = [{word.strip("'") for word in one.split()} for one in ran.stdout.splitlines()]
    assert dict(zip(lines, answers, strict=True)) == lines, ran.stderr


@pytest.mark.filterwarnings("ignore:os.fork")  # JAX's: what forks here is another program at once
@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh here")
def test_zsh_completes_a_line_as_it_is_typed(there: Path):
    pexpect = pytest.importorskip("pexpect")
    (there / "asking").write_text(ZSH)
    terminal = pexpect.spawn("zsh -f -i", encoding="utf-8", dimensions=(24, 200), timeout=30)
    terminal.sendline(". ./asking")
    terminal.expect(ANSWER)
    for line, words in (LINES | FILES).items():
        terminal.send(f"{line}\t")
        terminal.expect(ANSWER)
        *before, last = line.split(" ")
        completed = next(iter(words)) if len(words) == 1 else last
        assert terminal.match[1].replace("'", "").strip() == " ".join([*before, completed])
    terminal.close(force=True)


@pytest.mark.parametrize("shell", HOW)
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
