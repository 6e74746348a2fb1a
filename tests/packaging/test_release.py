"""Extras, versions, Pythons and workflows agree with each other."""

import re
import tomllib

import pytest
from packaging.requirements import Requirement

from stickslip.cli import EXTRAS
from tests.documents import ROOT
from tests.extras import IMPORT_NAMES

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
OPTIONAL = PROJECT["optional-dependencies"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def brought(extra: str) -> set[str]:
    """Names of the packages that an extra asks for itself."""
    return {Requirement(line).name for line in OPTIONAL[extra]}


def test_pytorch_comes_with_its_own_extras_alone():
    needs = {"stable-baselines3", "sbx-rl", "torchrl", "torch"}
    large = {"sb3", "sbx", "torchrl"}
    assert {name for name in OPTIONAL if needs & brought(name)} == large
    asked = [Requirement(line) for line in OPTIONAL["all"]]
    asked = [one for one in asked if one.extras & large]
    assert [str(one.marker) for one in asked] == ['sys_platform != "linux"']


@pytest.mark.parametrize("package", EXTRAS)
def test_a_missing_package_is_in_the_extra_that_is_named(package: str):
    names = {IMPORT_NAMES.get(name, name) for name in brought(EXTRAS[package])}
    assert package in names | ({"torch"} if "stable_baselines3" in names else set())


def test_the_version_is_one():
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"(?m)^version: (.*)$", citation) == [PROJECT["version"]]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"(?m)^## \[?([^\]\n ]+)", changes)
    assert versions[:2] == ["Unreleased", PROJECT["version"]]


def test_the_pythons_of_the_classifiers_are_tested():
    said = re.findall(r"Python :: (3\.\d+)", "\n".join(PROJECT["classifiers"]))
    assert f"PYTHONS:-{' '.join(said)}}}" in (ROOT / "release/check.sh").read_text(encoding="utf-8")
    assert PROJECT["requires-python"] == f">={said[0]}"
    for python in said:
        assert f'"{python}"' in (ROOT / ".github/workflows/tests.yml").read_text(encoding="utf-8")


def test_workflows_make_what_the_makefile_has():
    text = "\n".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    asked = set(re.findall(r"run: make ([\w-]+)", text))
    made = set(re.findall(r"(?m)^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8")))
    pages = {"docs"} if not (ROOT / "mkdocs.yml").exists() else set()
    assert "test" in asked
    assert asked - pages <= made


def test_workflows_pin_actions_by_commit_and_say_the_version():
    text = "\n".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    used = re.findall(r"uses: (?!\./)(.*)", text)
    assert used
    assert [
        one for one in used if not re.fullmatch(r"[\w/-]+@[0-9a-f]{40} # v\d+(\.\d+)+", one)
    ] == []
