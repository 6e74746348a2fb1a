"""Tests whose packages are missing are skipped, and the extra that brings them is named.

A test or its file imports what it needs, as a user does: a ModuleNotFoundError of a package of an
extra is the reason of a skip. SB3 marks what `make test-sb3` runs in an environment of its own.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SB3 = pytest.mark.sb3
IMPORT_NAMES = {
    "imageio-ffmpeg": "imageio_ffmpeg",
    "mkdocs-material": "material",
    "mkdocstrings-python": "mkdocstrings_handlers",
    "pillow": "PIL",
    "pygame-ce": "pygame",
    "sbx-rl": "sbx",
    "stable-baselines3": "stable_baselines3",
}
IMPLIED = {"torch": "sb3"}


def extras() -> dict[str, str]:
    """Package, as imported -> the first extra that brings it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = dict(IMPLIED)
    for extra, lines in project["optional-dependencies"].items():
        for line in lines:
            name = re.split(r"[\[<>=!~; ]", line, maxsplit=1)[0]
            found.setdefault(IMPORT_NAMES.get(name, name), extra)
    return found


EXTRAS = extras()
MISSING = {package for package in EXTRAS if find_spec(package) is None}


def skip_what_is_missing(error: BaseException | None) -> None:
    """Skip where an extra's package is what the error is of; else nothing."""
    package = (getattr(error, "name", None) or "").partition(".")[0]
    if isinstance(error, ModuleNotFoundError) and package in MISSING:
        reason = f"needs {package} (extra {EXTRAS[package]})"
        pytest.skip(reason, allow_module_level=True)


class File(pytest.Module):
    """A file of tests that may need an extra to be imported."""

    def collect(self) -> object:
        """The tests in it."""
        try:
            return super().collect()
        except self.CollectError as error:
            skip_what_is_missing(error.__cause__)
            raise


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module:
    return File.from_parent(parent, path=module_path)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    if item.get_closest_marker("sb3") and "stable_baselines3" in MISSING:
        pytest.skip("needs stable_baselines3 (extra sb3)")
    yield from skipping()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call() -> Iterator[None]:
    yield from skipping()


def skipping() -> Iterator[None]:
    """Of a hook: skip a test whose extra is missing."""
    try:
        yield
    except ModuleNotFoundError as error:
        skip_what_is_missing(error)
        raise
