"""The built wheel works outside the checkout with its core dependencies only.

A source distribution is built from a copy of the tree, the wheel from that, and the wheel is
installed at the pinned versions into a new virtual environment; installed_checks.py then imports
it and steps every environment. Most of the time goes into installing, which needs the network.
"""

import os
import shutil
import subprocess
import sys
import tomllib
import venv
from pathlib import Path

import pytest

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
    """The wheel, built from a copy so that no earlier build leaks in."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns(*NOT_SOURCE))
    run(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, source, cwd=folder)
    (built,) = folder.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def scripts(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of executables of a clean environment with the wheel and its core dependencies."""
    home = tmp_path_factory.mktemp("clean")
    venv.create(home, with_pip=True)
    folder = home / ("Scripts" if os.name == "nt" else "bin")
    install = ["-m", "pip", "--disable-pip-version-check", "--no-input", "install", "--quiet"]
    run(folder / "python", *install, "-c", ROOT / "constraints.txt", wheel, cwd=home)
    return folder


@pytest.mark.long
def test_installed_wheel_steps_every_environment(scripts: Path, tmp_path: Path):
    shown = run(scripts / "python", "-I", "-W", "error", CHECKS, cwd=tmp_path)
    assert "stickslip/Biped-v0" in shown


def test_installed_command_tells_its_version(scripts: Path, tmp_path: Path):
    assert VERSION in run(scripts / "stickslip", "--version", cwd=tmp_path)


def test_installed_wheel_has_every_layer(scripts: Path, tmp_path: Path):
    code = "import stickslip as s; s.envs.BipedEnv, s.optim.PostureProblem, s.dynamics.Scene"
    run(scripts / "python", "-I", "-W", "error", "-c", code, cwd=tmp_path)
