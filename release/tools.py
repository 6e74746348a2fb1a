"""Running uv and the tools that it brings, apart from whatever environment calls this."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path

from release.report import FailedError

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NOT_OURS = ("PYTHON", "PYTEST", "JAX_", "XLA_", "VIRTUAL_ENV", "CONDA", "STICKSLIP_")
"""Beginnings of variables that would make a clean environment less clean."""
OURS = {"JAX_PLATFORMS": "cpu", "SDL_VIDEODRIVER": "dummy", "UV_PYTHON_DOWNLOADS": "never"}


def uv() -> str:
    """Where uv is: beside this Python, or on the path."""
    found = shutil.which("uv", path=sysconfig.get_path("scripts")) or shutil.which("uv")
    if found is None:
        sys.exit("this needs uv, which is not installed; run: pip install uv")
    return found


def run(
    *command: str | Path,
    cwd: Path = ROOT,
    variables: Mapping[str, str] | None = None,
    follow: Callable[[str], None] | None = None,
) -> str:
    """Run a command as from a new terminal; its stdout. FailedError with all that it said.

    `follow` is told every line as it comes, and what is returned then holds stderr, too.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(NOT_OURS)}
    with subprocess.Popen(
        [str(part) for part in command],
        cwd=cwd,
        env=kept | OURS | dict(variables or {}),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT if follow else subprocess.PIPE,
        text=True,
    ) as process:
        try:
            if follow and process.stdout:
                lines = []
                for line in process.stdout:
                    follow(line)
                    lines.append(line)
                said, complained = "".join(lines), ""
            else:
                said, complained = process.communicate()
        except BaseException:
            process.kill()
            raise
    if process.returncode:
        shown = " ".join(str(part) for part in command)
        raise FailedError(f"{shown}\nexit status {process.returncode}\n{said}{complained}")
    return said


def tool(pinned: str, *arguments: str | Path, cwd: Path = ROOT) -> str:
    """Run a tool, `name==version`, in an environment of its own."""
    name = pinned.partition("==")[0]
    return run(uv(), "tool", "run", "--from", pinned, name, *arguments, cwd=cwd)


def quickly(python: Path) -> str:
    """XLA's settings that `make test` compiles with, but those that an environment's XLA lacks.

    XLA ends the process that names a setting which it does not know; the plain emitter went with
    jaxlib 0.11.
    """
    found = re.search(r"(?m)^QUICKLY := (.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"))
    if found is None:
        raise FailedError("the Makefile has no QUICKLY")
    try:
        run(python, "-I", "-c", "import jax; jax.devices()", variables={"XLA_FLAGS": found[1]})
    except FailedError as error:
        unknown = re.search(r"Unknown flags? in XLA_FLAGS: (.*)", f"{error}")
        if unknown is None:
            raise
        return " ".join(flag for flag in found[1].split() if flag not in unknown[1].split())
    return found[1]


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
