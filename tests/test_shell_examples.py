"""The commands of README and docs, run page by page in their order, with less to do."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from stickslip.agents.policy.file import policy_path
from stickslip.cli import OK, main
from tests.documents import ROOT, every_block
from tests.extras import SB3
from tests.test_examples import commands

NOT_RUN = r"^(pip|make|python|uvx) "
"""What installs, or measures."""
ADDED = {
    "train": ("--no-pictures",),
    "evaluate": ("--episodes", "2"),
    "sweep": ("--episodes", "2", "--no-pictures"),
    "view": ("--seconds", "0.3"),
    "reproduce": ("--samples", "24"),
}
"""By command: what makes less of it, in place of what the line says."""
STEPS = {"ugv": "16384"}
"""Of a training that names this; of all others LEAST."""
LEAST = "32768"
POLICIES = {"policy.npz": "biped-sprint", "walk.npz": "biped-steady"}
"""Files that pages take for granted."""


def pages() -> dict[str, list[str]]:
    """Lines to run, by page; what stands on several pages runs on the first."""
    found: dict[str, list[str]] = {}
    for one in commands():
        page, _, line = one.id.partition(": ")
        if not re.search(NOT_RUN, line.split("  #")[0].strip()):
            found.setdefault(page, []).append(line)
    return found


def less(line: str) -> list[str]:
    """A line's words, without the program and where its output goes, with less to do."""
    words = shlex.split(re.sub(r" >>? ?\S+$", "", line), comments=True)[1:]
    added = list(ADDED.get(words[0], ()))
    if words[0] == "train" and "--resume" not in words:
        added += ["--timesteps", next((STEPS[one] for one in STEPS if one in words), LEAST)]
    if words[0] == "reproduce":
        words = ["fig13" if word == "all" else word for word in words]
    if words[:2] == ["bench", "run"]:
        added += ["--budget", "60"]
    for flag in (one for one in added if one.startswith("--") and one in words):
        at = words.index(flag)
        del words[at : at + 2]
    return [re.sub(r"^(\w+=[\d.]+:[\d.]+):\d+$", r"\1:2", word) for word in words] + added


def page(name: str, lines: list[str]):
    return pytest.param(lines, id=name, marks=[SB3] if "sb3" in " ".join(lines) else [])


@pytest.mark.long
@pytest.mark.parametrize("lines", [page(*one) for one in pages().items()])
def test_the_commands_of_a_page_run_one_after_the_other(lines, tmp_path: Path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    for file, policy in POLICIES.items():
        shutil.copy(policy_path(policy), file)
    for line in lines:
        assert main(less(line)) == OK, (line, capfd.readouterr().err)


@pytest.mark.long
def test_the_program_of_a_machine_of_ones_own_is_trained_and_viewed(tmp_path: Path):
    (program,) = (one.code for one in every_block() if "from mass import MassMachine" in one.code)
    (tmp_path / "mine.py").write_text(program, encoding="utf-8")
    shutil.copy(ROOT / "tests" / "agents" / "mass.py", tmp_path)
    page = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
    lines = re.findall(r"`python (mine\.py [^`]+)`", " ".join(page.split()))
    assert [line.split()[1] for line in lines] == ["train", "view"]
    for line in lines:
        subprocess.run([sys.executable, *line.split()], cwd=tmp_path, check=True)
    assert list(tmp_path.glob("*.gif"))
