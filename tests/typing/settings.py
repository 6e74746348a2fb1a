"""Write build/pyrightconfig.json: pyproject.toml's settings, and what they cannot say.

`make typecheck` runs this. Where Stable-Baselines3 is not installed (extra sb3), the files that
import it or PyTorch are ignored and named; all else is checked as it is where it is there.
"""

from __future__ import annotations

import ast
import json
import sys
from importlib.util import find_spec
from pathlib import Path

from tests.packaging.test_layers import imports

ROOT = Path(__file__).parents[2]
FILE = ROOT / "build" / "pyrightconfig.json"
LARGE = ("stable_baselines3", "torch")


def missing() -> set[str]:
    """Of the packages in LARGE, those that are not installed."""
    return {package for package in LARGE if find_spec(package) is None}


def uses(source: str, packages: set[str]) -> bool:
    """Whether a program imports one of the packages."""
    found = imports(ast.parse(source))
    return any(name.partition(".")[0] in packages for name, _, _ in found)


def main() -> None:
    """Write the file and name what is ignored."""
    absent, ignored = missing(), []
    for folder in ("build/typing/stickslip", "benchmarks"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            if absent and uses(path.read_text(encoding="utf-8"), absent):
                ignored.append(path.relative_to(ROOT).as_posix())
    settings = {
        "extends": "../pyproject.toml",
        "venvPath": str(Path(sys.prefix).parent),
        "venv": Path(sys.prefix).name,
        "extraPaths": ["typing", ".."],
        "ignore": [f"../{name}" for name in ignored],
    }
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(json.dumps(settings, indent=1), encoding="utf-8")
    if ignored:
        print(f"not checked, since {', '.join(sorted(absent))} is not installed:", *ignored)


if __name__ == "__main__":
    main()
