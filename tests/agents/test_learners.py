"""Scripts of docs/learners, each with few steps: they end with a score."""

import ast
import math
import subprocess
import sys
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.documents import ROOT

SCRIPTS = sorted((ROOT / "docs" / "learners").glob("*.py"))


def missing(script: Path) -> set[str]:
    """Packages that a script imports and that are not installed."""
    nodes = list(ast.walk(ast.parse(script.read_text(encoding="utf-8"))))
    names = {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}
    names |= {one.name for node in nodes if isinstance(node, ast.Import) for one in node.names}
    return {name for name in {name.split(".")[0] for name in names} if find_spec(name) is None}


@pytest.mark.long
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_ends_with_a_score(script: Path):
    if lacking := missing(script):
        pytest.skip(f"needs {', '.join(sorted(lacking))}")
    if script.stem == "gymnax1" and version("gymnax").startswith("0"):
        pytest.skip("needs gymnax 1")
    run = [sys.executable, str(script), "20" if script.stem == "minari_bc" else "5000"]
    printed = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert math.isfinite(float(printed.splitlines()[-1].removeprefix("score ")))
