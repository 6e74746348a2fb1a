"""Size of the project, and of the part that one call enters.

    python -m benchmarks.size [--only PART ...] [--docs docs/design.md]

Lines are those of the files, blank ones and docstrings included. Flags are the long options of
each command, for either machine. The files that a call enters are those of the project in which
a function runs, counted by `sys.setprofile` in a process of its own: a step of the biped's
environment while it is traced, a short training, a posture problem solved by dynamic programming.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from benchmarks.report import markdown, put_between

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ("dynamics", "optim", "envs", "agents", "src")
MACHINES = ("biped", "ugv")

CALLS = {
    "biped env.step, traced": """
import jax
from stickslip.envs import BipedEnv
env = BipedEnv()
params, key = env.make_params(), jax.random.key(0)
obs, state = env.reset(key, params)
def call():
    jax.make_jaxpr(env.step)(key, state, jax.numpy.zeros(1), params)
""",
    "train biped --no-pictures": """
import tempfile
from pathlib import Path
from stickslip.cli import main
out = Path(tempfile.mkdtemp()) / "run"
def call():
    main(["train", "biped", "--timesteps", "4000", "--no-pictures", "--out", str(out)])
""",
    'solve(problem, method="dp")': """
import gymnasium  # while it is not imported, its import is watched for, whatever is imported
from stickslip.dynamics.ugv import Track
from stickslip.optim import PostureProblem, solve
problem = PostureProblem.along(Track.bump(), "total_energy", spacing=0.2)
def call():
    solve(problem, method="dp")
""",
}
"""Each defines `call`, whose frames are counted; what it imports before is not."""

COUNT = """
import sys
seen = set()
def watch(frame, event, _):
    if frame.f_code.co_name != "<module>":
        seen.add(frame.f_code.co_filename)
import threading
threading.setprofile(watch)
sys.setprofile(watch)
try:
    call()
finally:
    sys.setprofile(None)
inside = [name for name in seen if name.startswith(ROOT) and "/.venv/" not in name]
print("files entered:", len(inside), flush=True)
"""


def source() -> list[dict[str, Any]]:
    """Lines, files and folders of Python."""
    own = [_python(name, [name]) for name in ("benchmarks", "tests")]
    rest = _python("documentation, release", ("documentation", "release"))
    return [_python("package", PACKAGE), *own, rest]


def words() -> list[dict[str, Any]]:
    """Words of the documents."""
    pages = ROOT / "README.md", *(ROOT / "docs").glob("*.md")
    each = [len(page.read_text(encoding="utf-8").split()) for page in pages]
    return [{"of": "README", "words": each[0]}, {"of": "README and docs", "words": sum(each)}]


def _python(name: str, folders: Iterable[str]) -> dict[str, Any]:
    files = [file for folder in folders for file in (ROOT / folder).rglob("*.py")]
    lines = [len(file.read_text(encoding="utf-8").splitlines()) for file in files]
    return {
        "of": name,
        "lines": sum(lines),
        "files": len(files),
        "folders": len({file.parent for file in files}),
        "longest file": max(lines),
    }


def flags() -> list[dict[str, Any]]:
    """Flags of all commands together, and of `train biped`."""
    from stickslip.commands import COMMANDS

    each = {name: set().union(*(_flags([name, one]) for one in MACHINES)) for name in COMMANDS}
    return [
        {"of": "all commands", "flags": sum(map(len, each.values()))},
        {"of": "train biped", "flags": len(_flags(["train", "biped"]))},
    ]


def _flags(words: list[str]) -> set[str]:
    """Long options of a command."""
    from stickslip.cli import make_parser

    parser: Any = make_parser(words)
    for word in words:
        inner = (one.choices for one in parser._actions if isinstance(one.choices, dict))
        parser = next(inner, {}).get(word, parser)
    return {text for one in parser._actions for text in one.option_strings if text[:2] == "--"}


def calls() -> list[dict[str, Any]]:
    """Files of the project that each of CALLS enters."""
    rows = []
    for name, program in CALLS.items():
        text = f"ROOT = {str(ROOT)!r}\n{program}\n{COUNT}"
        done = subprocess.run(
            [sys.executable, "-c", text], cwd=ROOT, capture_output=True, text=True, check=False
        )
        counted = re.search(r"files entered: (\d+)", done.stdout)
        if counted is None:
            raise RuntimeError(f"{name} failed: {done.stderr[-2000:]}")
        rows.append({"of": name, "files entered": int(counted[1])})
        print(f"  {name}: {counted[1]}", flush=True)
    return rows


PARTS = {"source": source, "words": words, "flags": flags, "calls": calls}


def main() -> None:
    """Count, print the tables, put them into a page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=list(PARTS), default=list(PARTS))
    parser.add_argument("--docs", type=Path, help="page that holds the tables")
    given = parser.parse_args()
    text = "\n\n".join(markdown(PARTS[part]()) for part in given.only)
    print(text)
    if given.docs:
        put_between(given.docs, text, "size")


if __name__ == "__main__":
    main()
