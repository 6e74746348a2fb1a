"""pyproject.toml lists the package folders that exist: a wheel lacks what the list forgot."""

import subprocess
import sys
import tomllib
from pathlib import Path

from tests.documents import ROOT

LAYERS = ("dynamics", "optim", "envs", "agents")
SETUPTOOLS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"][
    "setuptools"
]


def package_folders() -> dict[str, str]:
    """Import name -> folder, for every folder of the tree that holds an __init__.py."""
    tops = {"stickslip": ROOT / "src" / "stickslip"}
    tops |= {f"stickslip.{layer}": ROOT / layer for layer in LAYERS}
    found = {}
    for name, top in tops.items():
        for init in top.rglob("__init__.py"):
            inner = init.parent.relative_to(top).parts
            found[".".join((name, *inner))] = init.parent.relative_to(ROOT).as_posix()
    return found


def test_every_package_folder_is_listed_and_every_listed_package_exists():
    assert sorted(SETUPTOOLS["packages"]) == sorted(package_folders())


def test_package_dir_maps_each_package_to_its_folder():
    assert SETUPTOOLS["package-dir"] == package_folders()


def test_every_folder_of_modules_is_a_package():
    folders = {ROOT / folder for folder in package_folders().values()}
    tops = [ROOT / "src" / "stickslip", *(ROOT / layer for layer in LAYERS)]
    modules = [module for top in tops for module in top.rglob("*.py")]
    assert [module for module in modules if module.parent not in folders] == []


def test_the_package_is_found_from_beside_a_folder_of_its_name(tmp_path: Path):
    """The checkout is such a folder: Python takes it for a namespace package."""
    (tmp_path / "stickslip").mkdir()
    line = "import gymnasium, stickslip; gymnasium.spec('stickslip/Biped-v0')"
    ran = subprocess.run([sys.executable, "-c", line], cwd=tmp_path, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
