"""The source distribution and the wheel: made from the tracked files, and what is in them."""

from __future__ import annotations

import shutil
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

from release.report import FailedError, Report
from release.tools import PROJECT, ROOT, run, tool, uv

TWINE, CONTENTS, CITATION = "twine==7.0.0", "check-wheel-contents==0.6.3", "cffconvert==2.0.0"
MADE = ("PKG-INFO", "setup.cfg", "stickslip.egg-info/")
"""What setuptools adds to a source distribution."""
Built = tuple[Path, Path]


def tracked() -> list[str]:
    """Files of the checkout that git knows and that are there."""
    names = run("git", "ls-files", "-z").split("\0")
    return sorted(name for name in names if name and (ROOT / name).is_file())


def build(out: Path, report: Report) -> Built:
    """Build the source distribution from a copy of the tracked files, and the wheel from it."""
    out.mkdir(parents=True, exist_ok=True)
    name = f"stickslip-{PROJECT['version']}"
    source, wheel = out / f"{name}.tar.gz", out / f"{name}-py3-none-any.whl"
    with (
        report.check(f"build {source.name} and {wheel.name}"),
        tempfile.TemporaryDirectory(prefix="stickslip-source-") as folder,
    ):
        copy, made = Path(folder) / "source", Path(folder) / "made"
        for name in tracked():
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name)
        run(uv(), "build", "--quiet", "--out-dir", made, copy)
        for path in (source, wheel):
            shutil.copy2(made / path.name, path)
    if report.failed:
        raise SystemExit(report.end())
    return source, wheel


def look_into(source: Path, wheel: Path, report: Report) -> None:
    """Compare both with the checkout, and have the tools look at them."""
    with report.check("the source distribution holds every tracked file"):
        same(in_source(source), belongs_in_source(tracked()))
    with report.check("the wheel holds the package and nothing else"):
        same(in_wheel(wheel), belongs_in_wheel(tracked()))
    with report.check("twine"):
        tool(TWINE, "check", "--strict", source, wheel)
    with report.check("check-wheel-contents"):
        tool(CONTENTS, "--no-config", "--toplevel", "stickslip", wheel)
    with report.check("CITATION.cff"):
        tool(CITATION, "--validate", "-i", ROOT / "CITATION.cff")


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


def in_wheel(path: Path) -> set[str]:
    """Files of a wheel, without its metadata but the licence."""
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    about = f"stickslip-{PROJECT['version']}.dist-info/"
    made = {about + name for name in ("METADATA", "WHEEL", "RECORD", "entry_points.txt")}
    made |= {about + "top_level.txt"}
    return {name.replace(about, "") for name in names if name not in made}


def belongs_in_wheel(files: list[str]) -> set[str]:
    """Every tracked file of a package's folder, data included, by its place in the wheel."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    places = table["tool"]["setuptools"]["package-dir"]
    found = {"licenses/LICENSE"}
    for package, folder in places.items():
        for name in files:
            if name.rpartition("/")[0] == folder:
                found.add(f"{package.replace('.', '/')}/{name.rpartition('/')[2]}")
    return found
