"""Clean environments with the wheel, and what a newcomer does in them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from release.report import FailedError, Report
from release.tools import PROJECT, ROOT, interpreter, run, uv

NEWCOMER = Path(__file__).with_name("newcomer")
PYTORCH = ("sb3", "sbx", "torchrl")
"""Extras that bring PyTorch, on Linux with 3 GB of CUDA's libraries: resolved, not installed."""
SEVERAL = ("all", "release")
"""All at once, and what runs this."""
FORBIDDEN = ("torch", "tensorflow")
"""What no light extra may bring."""


def extras() -> list[str]:
    """All of pyproject.toml's."""
    return list(PROJECT["optional-dependencies"])


def light() -> list[str]:
    """Those that are installed one by one."""
    return [name for name in extras() if name not in (*PYTORCH, *SEVERAL)]


def environment(python: str, folder: Path) -> Path:
    """A new environment; its interpreter."""
    run(uv(), "venv", "--quiet", "--no-project", "--python", interpreter(python), folder)
    return folder / "bin" / "python"


def program(name: str) -> Path:
    """What a newcomer does with an extra; where nothing is written for it, with the core."""
    own = NEWCOMER / f"{name}.py"
    return own if own.exists() else NEWCOMER / "core.py"


def use(python: Path, name: str) -> None:
    """Run the program in an empty folder, warnings as they are, and refuse PyTorch."""
    home = python.parents[1] / "home"
    home.mkdir()
    run(python, "-I", program(name), cwd=home)
    listed = run(uv(), "pip", "list", "--python", python, "--format", "freeze")
    found = {line.partition("==")[0].lower() for line in listed.splitlines()}
    if brought := found & set(FORBIDDEN):
        raise FailedError(f"it brings {', '.join(sorted(brought))}, which it should not")


def install_each(version: str, names: list[str], wheel: Path, here: Path, report: Report) -> None:
    """The wheel with each extra (`core`: none) in an environment of its own, and its program."""
    for name in names:
        folder = here / f"{version}-{name}"
        with report.check(f"Python {version}, {name}"):
            python = environment(version, folder)
            wanted = f"{wheel}" if name == "core" else f"{wheel}[{name}]"
            run(uv(), "pip", "install", "--quiet", "--python", python, wanted)
            use(python, name)
        shutil.rmtree(folder, ignore_errors=True)


def resolve_each(version: str, report: Report) -> None:
    """That versions are found which fit together, newest and pinned."""
    given = [uv(), "pip", "compile", "--quiet", "--no-header", "--python", interpreter(version)]
    for name in (*PYTORCH, "all"):
        with report.check(f"Python {version}, versions of {name}"):
            said = run(*given, "--extra", name, ROOT / "pyproject.toml")
            if not re.search(r"(?m)^jax==", said):
                raise FailedError(f"no jax among\n{said}")
    with report.check(f"Python {version}, versions of constraints.txt"):
        pinned = run(
            *given,
            "--no-annotate",
            "--extra",
            "all",
            "--extra",
            "sb3",
            "-c",
            ROOT / "constraints.txt",
            ROOT / "pyproject.toml",
        )
        lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
        known = {line for line in lines if line and not line.startswith("#")}
        if loose := [line for line in pinned.splitlines() if line.split(" ")[0] not in known]:
            raise FailedError("not pinned in constraints.txt:\n" + "\n".join(loose))
