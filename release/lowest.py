"""The lowest versions that pyproject.toml says: they install together and work."""

from __future__ import annotations

import re
import shutil
import tarfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from release.installs import environment, use
from release.report import Check, Say
from release.tools import ROOT, quickly, run, uv

COLUMN = "lowest"
ROOMS = ("tests/records", "tests/dynamics", "tests/optim", "tests/envs")
BESIDE = ("train", "optim", "viz", "brax", "gymnax")
"""Extras that these rooms have tests of."""
TESTING = ("pytest", "pytest-xdist", "hypothesis", "jaxtyping", "beartype")
"""What the tests themselves need, at the pinned versions."""


def lowest(python: Path, names: Sequence[str], wheel: Path, folder: Path) -> Path:
    """Install the wheel beside the lowest versions of its core and of extras; the list of them."""
    listed = folder / "lowest.txt"
    extra = [f"--extra={name}" for name in names if name != "core"]
    given = [uv(), "pip", "compile", "--quiet", "--python", python, "--resolution"]
    run(*given, "lowest-direct", *extra, "-o", listed, ROOT / "pyproject.toml")
    install = [uv(), "pip", "install", "--quiet", "--python", python]
    run(*install, "-r", listed)
    run(*install, "--no-deps", wheel)
    return listed


def install(version: str, name: str, wheel: Path, here: Path, say: Say) -> None:
    """As `installs.install`, with the lowest versions."""
    folder = here / f"lowest-{name}"
    try:
        python = environment(version, folder)
        lowest(python, [name], wheel, folder)
        use(python, name, say)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def each(version: str, names: list[str], wheel: Path, here: Path) -> Iterator[Check]:
    """The lowest versions of the core and of each extra."""
    for name in names:
        yield Check(name, COLUMN, partial(install, version, name, wheel, here))


def run_tests(version: str, built: tuple[Path, Path], here: Path, say: Say) -> None:
    """The core rooms' quick tests out of the source distribution, with the wheel installed.

    Warnings are not errors here: old versions warn of each other.
    """
    folder, told = here / "tests", 0

    def percent(line: str) -> None:
        nonlocal told
        if (found := re.search(r"\[ *(\d+)%\]$", line.rstrip())) and int(found[1]) >= told + 10:
            told = int(found[1])
            say(f"{told}%")

    try:
        python = environment(version, folder)
        listed = lowest(python, BESIDE, built[1], folder)
        with tarfile.open(built[0]) as archive:
            archive.extractall(folder, filter="data")
        source = folder / built[0].name.removesuffix(".tar.gz")
        install = [uv(), "pip", "install", "--quiet", "--python", python, "-c", listed]
        run(*install, *TESTING)
        tests = [
            python,
            "-m",
            "pytest",
            "-q",
            "-W",
            "default",
            "--disable-warnings",
            "-n",
            "2",
            "--dist",
            "loadfile",
        ]
        said = run(
            *tests, *ROOMS, cwd=source, variables={"XLA_FLAGS": quickly(python)}, follow=percent
        )
        say(f"{said.strip().splitlines()[-1]};")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def tests(version: str, built: tuple[Path, Path], here: Path) -> Iterator[Check]:
    """The quick tests of the core rooms."""
    rooms = ", ".join(name.removeprefix("tests/") for name in ROOMS)
    yield Check(f"tests of {rooms}", COLUMN, partial(run_tests, version, built, here))
