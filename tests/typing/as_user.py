"""The documents' Python, a user's script and a user's machine, as a user's type checker sees it.

`make typecheck` runs this. stickslip stands in a site-packages folder: what has no type is unknown.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.documents import Block, programs
from tests.typing import settings

ROOT = Path(__file__).parents[2]
HERE = ROOT / "build" / "user"
SCRIPTS = (Path(__file__).with_name("user_script.py"), ROOT / "tests" / "agents" / "mass.py")


def laid_out(chain: list[Block]) -> str:
    """A program on the document's own lines."""
    text = ""
    for block in chain:
        text += "\n" * (block.line - text.count("\n")) + block.code
    return text


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


def lay_out() -> dict[str, str]:
    """Make the folder; file in it -> the document, or the script, that it is taken from."""
    shutil.rmtree(HERE, ignore_errors=True)
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    install(HERE / "venv" / "lib" / version / "site-packages")
    of, absent = {}, settings.missing()
    for chain in programs():
        name, line, program = chain[0].page, chain[-1].line, laid_out(chain)
        if settings.uses(program, absent):
            print(f"not checked: {name}:{line}, which needs {', '.join(sorted(absent))}")
            continue
        file = HERE / f"{Path(name).stem}_{line}.py"
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
    of = lay_out()
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
