"""The source distribution and the wheel: made from the tracked files, and what is in them."""

from __future__ import annotations

import shutil
import tarfile
import tempfile
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

from release.report import Check, FailedError, Say
from release.tools import PROJECT, ROOT, run, tool, uv

TWINE, CONTENTS, CITATION = "twine==7.0.0", "check-wheel-contents==0.6.3", "cffconvert==2.0.0"
MADE = ("PKG-INFO", "setup.cfg", "stickslip.egg-info/")
"""What setuptools adds to a source distribution."""
COLUMN = "built"
Built = tuple[Path, Path]


def tracked() -> list[str]:
    """Files of the checkout that git knows and that are there."""
    names = run("git", "ls-files", "-z").split("\0")
    return sorted(name for name in names if name and (ROOT / name).is_file())


def paths(out: Path) -> Built:
    """Where the source distribution and the wheel are."""
    name = f"stickslip-{PROJECT['version']}"
    return out / f"{name}.tar.gz", out / f"{name}-py3-none-any.whl"


def build(out: Path) -> None:
    """Build the source distribution from a copy of the tracked files, and the wheel from it."""
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="stickslip-source-") as folder:
        copy, made = Path(folder) / "source", Path(folder) / "made"
        for name in tracked():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name)
        run(uv(), "build", "--quiet", "--out-dir", made, copy)
        for path in paths(out):
            shutil.copy2(made / path.name, path)


def checks(source: Path, wheel: Path) -> Iterator[Check]:
    """Compare both with the checkout, and have the tools look at them."""

    def holds_all(say: Say) -> None:
        same(in_source(source), belongs_in_source(tracked()))

    def holds_package(say: Say) -> None:
        same(set(in_wheel(wheel)), set(belongs_in_wheel(tracked())))
        as_in_checkout(wheel)

    def said_by(pinned: str, *arguments: str | Path) -> Callable[[Say], None]:
        return lambda say: (tool(pinned, *arguments), None)[1]

    yield Check("the source distribution holds every tracked file", COLUMN, holds_all)
    yield Check("the wheel holds the package and nothing else", COLUMN, holds_package)
    yield Check("twine", COLUMN, said_by(TWINE, "check", "--strict", source, wheel))
    contents = said_by(CONTENTS, "--no-config", "--toplevel", "stickslip", wheel)
    yield Check("check-wheel-contents", COLUMN, contents)
    citation = said_by(CITATION, "--validate", "-i", ROOT / "CITATION.cff")
    yield Check("CITATION.cff", COLUMN, citation)


def same(found: set[str], right: set[str]) -> None:
    """FailedError naming what is too much and what is missing."""
    if found != right:
        raise FailedError(f"too much: {sorted(found - right)}\nmissing: {sorted(right - found)}")


def in_source(path: Path) -> set[str]:
    """Files of a source distribution, without its folder and what setuptools made."""
    with tarfile.open(path) as archive:
        names = [one.name.partition("/")[2] for one in archive if one.isfile()]
    return {name for name in names if not name.startswith(MADE)}


def belongs_in_source(files: list[str]) -> set[str]:
    """All but what is for the repository's host and for git."""
    return {name for name in files if not name.startswith(".")}


def in_wheel(path: Path) -> dict[str, bytes]:
    """Files of a wheel with their content, without its metadata but the licence."""
    about = f"stickslip-{PROJECT['version']}.dist-info/"
    made = {about + name for name in ("METADATA", "WHEEL", "RECORD", "entry_points.txt")}
    made |= {about + "top_level.txt"}
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
        return {name.replace(about, ""): archive.read(name) for name in names if name not in made}


def belongs_in_wheel(files: list[str]) -> dict[str, str]:
    """Every tracked file of the packages' folders, data included, by its place in the wheel."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    places = table["tool"]["setuptools"]["package-dir"]
    packages = {f"{folder}/": f"{name.replace('.', '/')}/" for name, folder in places.items()}
    found = {"licenses/LICENSE": "LICENSE"}
    for name in files:
        if around := max(filter(name.startswith, packages), key=len, default=""):
            found[packages[around] + name.removeprefix(around)] = name
    return found


def as_in_checkout(wheel: Path) -> None:
    """FailedError naming the files of a wheel that are other than the checkout's."""
    sources, found = belongs_in_wheel(tracked()), in_wheel(wheel)
    other = [name for name, data in found.items() if data != (ROOT / sources[name]).read_bytes()]
    if other:
        raise FailedError(f"other than in the checkout: {other}")
