"""The built wheel works outside the checkout with its core dependencies only."""

import importlib.metadata
import os
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
CHECKS = Path(__file__).with_name("installed_checks.py")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
NOT_SOURCE = (".*", "build", "dist", "runs", "*.egg-info", "__pycache__")


def run(*command: str | Path, cwd: Path) -> str:
    """Run a command without the caller's Python settings; return stdout, or fail with all of it."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYTHON", "PYTEST", "JAX_", "VIRTUAL_ENV"))
    }
    done = subprocess.run(
        [str(part) for part in command],
        cwd=cwd,
        env=environment | {"JAX_PLATFORMS": "cpu"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        shown = " ".join(str(part) for part in command)
        pytest.fail(f"{shown}\nexit status {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of a source distribution of a copy, so that no earlier build leaks in."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


def needed(names: list[str], found: dict[str, importlib.metadata.Distribution]) -> None:
    """Add the distributions named, and what they need without extras, to `found`."""
    for name in names:
        one = Requirement(name)
        key = one.name.lower().replace("_", "-")
        if key in found or (one.marker and not one.marker.evaluate({"extra": ""})):
            continue
        found[key] = importlib.metadata.distribution(one.name)
        needed(found[key].requires or [], found)


@pytest.fixture(scope="module")
def linked(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Executables of a new environment with the wheel, and links to the packages that it needs."""
    home = tmp_path_factory.mktemp("linked")
    venv.create(home, with_pip=False)
    folder = home / ("Scripts" if os.name == "nt" else "bin")
    python = folder / "python"
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-input"]
    bare = ("--quiet", "--no-deps", "--no-index", "--no-compile")
    run(*pip, "--python", python, "install", *bare, wheel, cwd=home)
    code = "import sysconfig; print(sysconfig.get_path('purelib'))"
    site = Path(run(python, "-c", code, cwd=home).strip())
    (about,) = site.glob("stickslip-*.dist-info")
    found: dict[str, importlib.metadata.Distribution] = {}
    needed(importlib.metadata.PathDistribution(about).requires or [], found)
    assert {"jax", "jaxlib", "numpy", "scipy"} < set(found)
    for one in found.values():
        for part in {file.parts[0] for file in one.files or [] if file.parts[0] != ".."}:
            if part != "__pycache__" and not (site / part).exists():
                (site / part).symlink_to(Path(str(one.locate_file(part))))
    return folder


def test_command_beside_the_core_dependencies_tells_its_version(linked: Path, tmp_path: Path):
    assert VERSION in run(linked / "stickslip", "--version", cwd=tmp_path)


def test_wheel_has_every_layer_and_needs_no_more_than_it_says(linked: Path, tmp_path: Path):
    code = """
import importlib.util, stickslip as s
s.envs.BipedEnv, s.optim.PostureProblem, s.dynamics.Scene
assert not any(map(importlib.util.find_spec, ("torch", "matplotlib", "hypothesis", "tests")))
from stickslip.envs.rendering.page import Page, page_text
assert "Leon Sorokin" in page_text(Page("a page of packaged data"))
assert {s.agents.load_policy(name).squash for name in s.agents.shipped_names()} == {"clip"}
print(s.__file__)
"""
    shown = run(linked / "python", "-I", "-W", "error", "-c", code, cwd=tmp_path)
    assert Path(shown.strip()).is_relative_to(linked.parent)


@pytest.mark.long
def test_installed_wheel_steps_every_environment(linked: Path, tmp_path: Path):
    shown = run(linked / "python", "-I", "-W", "error", CHECKS, cwd=tmp_path)
    assert "stickslip/Biped-v0" in shown
