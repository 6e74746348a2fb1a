"""The documents' Python, a user's first script and a user's machine, checked as a user's own type
checker does it.

`make typecheck` runs this. stickslip stands in a site-packages folder with its py.typed, as a
regular install puts it there: what has no type is then unknown to the checker, which infers the
types of a program's own functions only. Messages name document and line.
"""

from __future__ import annotations

import ast
import builtins
import json
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.typing import settings

ROOT = Path(__file__).parents[2]
HERE = ROOT / "build" / "user"
SCRIPTS = (Path(__file__).with_name("user_script.py"), ROOT / "tests" / "agents" / "mass.py")
BLOCK = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)
KNOWN = {*dir(builtins), "__name__", "__file__"}


def documents() -> list[Path]:
    """Where Python may be shown."""
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


def programs(text: str) -> Iterator[tuple[int, str]]:
    """Line and program of each block, on the document's own lines.

    A block that uses names which it does not make continues the one before it.
    """
    before = ""
    for block in BLOCK.finditer(text):
        line = text.count("\n", 0, block.start(1)) + 1
        alone = "\n" * (line - 1) + block[1]
        lines = before.count("\n")
        before = before + "\n" * (line - 1 - lines) + block[1] if missing(block[1]) else alone
        yield line, before


def missing(code: str) -> set[str]:
    """The names that a program uses and nowhere makes."""
    nodes = list(ast.walk(ast.parse(code)))
    names = [node for node in nodes if isinstance(node, ast.Name)]
    made = {name.id for name in names if isinstance(name.ctx, ast.Store)}
    made |= {node.arg for node in nodes if isinstance(node, ast.arg)}
    for node in nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            made |= {(one.asname or one.name).split(".")[0] for one in node.names}
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            made.add(node.name)
    return {name.id for name in names} - made - KNOWN


def install(folder: Path) -> None:
    """Put the package where a regular install would, and name what else is installed."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    for package, source in table["tool"]["setuptools"]["package-dir"].items():
        target = folder.joinpath(*package.split("."))
        target.mkdir(parents=True)
        for file in (ROOT / source).iterdir():
            if file.suffix == ".py" or file.name == "py.typed":
                shutil.copy(file, target)
    others = [path for path in sys.path if path.endswith("site-packages")]
    (folder / "others.pth").write_text("\n".join(others), encoding="utf-8")


def lay_out(paths: Iterable[Path]) -> dict[str, str]:
    """Make the folder; file in it -> the document, or the script, that it is taken from."""
    shutil.rmtree(HERE, ignore_errors=True)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    install(HERE / "venv" / "lib" / version / "site-packages")
    of, absent = {}, settings.missing()
    for document in paths:
        name = document.relative_to(ROOT).as_posix()
        for line, program in programs(document.read_text(encoding="utf-8")):
            if settings.uses(program, absent):
                print(f"not checked: {name}:{line}, which needs {', '.join(sorted(absent))}")
                continue
            file = HERE / f"{document.stem}_{line}.py"
            file.write_text(program, encoding="utf-8")
            of[file.name] = name
    for script in SCRIPTS:
        shutil.copy(script, HERE)
        of[script.name] = script.relative_to(ROOT).as_posix()
    found = {
        "include": sorted(of),
        "venvPath": ".",
        "venv": "venv",
        "pythonVersion": version.removeprefix("python"),
        "typeCheckingMode": "standard",
    }
    (HERE / "pyrightconfig.json").write_text(json.dumps(found, indent=1), encoding="utf-8")
    return of


def main() -> None:
    """Check, print each finding with where it stands in its document, and fail if there is one."""
    of = lay_out(documents())
    checker = Path(sys.executable).with_name("basedpyright")
    ran = subprocess.run(
        [checker, "-p", HERE, "--outputjson"], capture_output=True, text=True, check=False
    )
    if not ran.stdout.lstrip().startswith("{"):
        sys.exit(ran.stdout + ran.stderr)
    told = json.loads(ran.stdout)
    found = {
        f"{of[Path(one['file']).name]}:{one['range']['start']['line'] + 1}: "
        f"{one['message']} ({one.get('rule', one['severity'])})"
        for one in told["generalDiagnostics"]
    }
    if told["summary"]["filesAnalyzed"] != len(of):
        sys.exit(f"{told['summary']['filesAnalyzed']} files were checked of {len(of)}")
    print(*sorted(found), f"{len(of)} programs of a user: {len(found)} findings", sep="\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
