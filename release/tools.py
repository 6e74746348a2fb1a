"""Running uv and the tools that it brings, apart from whatever environment calls this."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from pathlib import Path

from release.report import FailedError

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NOT_OURS = ("PYTHON", "PYTEST", "JAX_", "XLA_", "VIRTUAL_ENV", "CONDA", "STICKSLIP_")
"""Beginnings of variables that would make a clean environment less clean."""


def uv() -> str:
    """Where uv is: beside this Python, or on the path."""
    found = shutil.which("uv", path=sysconfig.get_path("scripts")) or shutil.which("uv")
    if found is None:
        sys.exit("this needs uv, which is not installed; run: pip install uv")
    return found


def run(*command: str | Path, cwd: Path = ROOT) -> str:
    """Run a command as from a new terminal; its stdout. FailedError with all that it said."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(NOT_OURS)}
    kept |= {"JAX_PLATFORMS": "cpu", "SDL_VIDEODRIVER": "dummy", "UV_PYTHON_DOWNLOADS": "never"}
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=kept,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        shown = " ".join(str(part) for part in command)
        raise FailedError(f"{shown}\nexit status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def tool(pinned: str, *arguments: str | Path, cwd: Path = ROOT) -> str:
    """Run a tool, `name==version`, in an environment of its own."""
    name = pinned.partition("==")[0]
    return run(uv(), "tool", "run", "--from", pinned, name, *arguments, cwd=cwd)


def interpreter(version: str) -> str:
    """An interpreter `3.11` as uv finds it, or of pyenv. FailedError where there is none."""
    try:
        return run(uv(), "python", "find", "--no-project", "--system", version).strip()
    except FailedError:
        home = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
        found = sorted(home.glob(f"{version}.*/bin/python3"))
        if not found:
            raise
        return str(found[-1])
