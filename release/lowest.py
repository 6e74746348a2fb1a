"""The lowest versions that pyproject.toml says: they install together and work."""

from __future__ import annotations

import shutil
from pathlib import Path

from release.installs import environment, use
from release.report import Report
from release.tools import ROOT, run, uv

ROOMS = ("tests/records", "tests/dynamics", "tests/optim", "tests/envs")
TESTING = ("pytest", "pytest-xdist", "hypothesis", "jaxtyping", "beartype")
"""What the tests themselves need, at the pinned versions."""


def lowest(python: Path, name: str, wheel: Path, folder: Path) -> Path:
    """Install the wheel beside the lowest versions of its core and an extra; the list of them."""
    listed = folder / "lowest.txt"
    extra = () if name == "core" else ("--extra", name)
    given = [uv(), "pip", "compile", "--quiet", "--python", python, "--resolution"]
    run(*given, "lowest-direct", *extra, "-o", listed, ROOT / "pyproject.toml")
    install = [uv(), "pip", "install", "--quiet", "--python", python]
    run(*install, "-r", listed)
    run(*install, "--no-deps", wheel)
    return listed


def install_each(version: str, names: list[str], wheel: Path, here: Path, report: Report) -> None:
    """As `installs.install_each`, with the lowest versions."""
    for name in names:
        folder = here / f"lowest-{name}"
        with report.check(f"Python {version}, lowest versions of {name}"):
            python = environment(version, folder)
            lowest(python, name, wheel, folder)
            use(python, name)
        shutil.rmtree(folder, ignore_errors=True)


def run_tests(version: str, wheel: Path, here: Path, report: Report) -> None:
    """The quick tests of the core rooms, against the installed wheel."""
    folder = here / "tests"
    with report.check(f"Python {version}, tests of {', '.join(ROOMS)} with the lowest versions"):
        python = environment(version, folder)
        listed = lowest(python, "core", wheel, folder)
        install = [uv(), "pip", "install", "--quiet", "--python", python, "-c", listed]
        run(*install, *TESTING)
        said = run(python, "-m", "pytest", "-q", "-n", "2", "--dist", "loadfile", *ROOMS)
        print(said.strip().splitlines()[-1], end=" ")
    shutil.rmtree(folder, ignore_errors=True)
