"""The tools of development start."""

import subprocess
import sys
from pathlib import Path

for tool in ("ruff", "basedpyright", "pytest", "pre-commit"):
    subprocess.run([Path(sys.executable).with_name(tool), "--version"], check=True)
subprocess.run([sys.executable, "-c", "import build, hypothesis, jaxtyping, beartype"], check=True)
