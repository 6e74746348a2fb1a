"""The quick part of shapes.py, in a process of its own: there stickslip is imported with checks."""

import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.long
def test_what_runs_has_the_shapes_that_signatures_say():
    command = ["-m", "pytest", "-q", "-p", "tests.typing.checked", "tests/typing/shapes.py"]
    ran = subprocess.run(
        [sys.executable, *command],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode == 0, ran.stdout + ran.stderr
