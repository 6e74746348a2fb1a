"""`make` installs what a target needs, adds what another needs, and begins anew what is torn."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="needs make")

PYTHON = """#!/usr/bin/env bash
case "$*" in
"-m venv --clear .venv")
    echo venv >> calls; rm -rf .venv; mkdir -p .venv/bin; cp "$0" .venv/bin/python ;;
*"pip "*" -e "*)
    echo "${@: -1}" >> calls
    [ "$FATE" != killed ] || kill -9 $PPID
    [ "$FATE" != refused ] ;;
esac
"""


class Checkout:
    """The Makefile with an interpreter that only writes down how it was called."""

    def __init__(self, path: Path):
        self.path = path
        path.mkdir()
        for name in ("Makefile", "pyproject.toml", "setup.py", "constraints.txt"):
            shutil.copy2(ROOT / name, path)
        (path / "python").write_text(PYTHON)
        (path / "python").chmod(0o755)

    def make(self, *arguments: str, fate: str = "") -> list[str]:
        """Environments made and extras installed by a call of make."""
        calls = self.path / "calls"
        calls.write_text("")
        given = ("MAKE", "EXTRAS", "PYTHON")  # by the make that these tests are run from
        kept = {name: value for name, value in os.environ.items() if not name.startswith(given)}
        done = subprocess.run(
            ["make", "PYTHON=./python", *arguments],
            cwd=self.path,
            env=kept | {"FATE": fate},
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode == 0) is (fate == ""), done.stdout + done.stderr
        return calls.read_text().split()


@pytest.fixture
def checkout(tmp_path: Path) -> Checkout:
    return Checkout(tmp_path / "a checkout")


def test_the_demo_installs_what_it_needs_and_tests_add_the_rest(checkout: Checkout):
    assert checkout.make(".venv/.demo") == ["venv", ".[train]"]
    assert checkout.make(".venv/.demo") == []
    assert checkout.make("venv") == [".[all]"]
    assert checkout.make("venv") == checkout.make(".venv/.demo") == []
    assert checkout.make("venv", "EXTRAS=all,sb3") == [".[all,sb3]"]
    assert checkout.make("venv") == checkout.make("venv", "EXTRAS=sb3") == []


def test_what_was_killed_or_moved_begins_anew(checkout: Checkout, tmp_path: Path):
    checkout.make(".venv/.demo")
    assert checkout.make("venv", fate="killed") == [".[all]"]
    assert checkout.make(".venv/.demo") == ["venv", ".[train]"]
    checkout.path = checkout.path.rename(tmp_path / "elsewhere")
    assert checkout.make(".venv/.demo") == ["venv", ".[train]"]
