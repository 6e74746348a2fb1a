"""Clean environments with the wheel, and what a newcomer does in them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from release.report import Check, FailedError, Say
from release.tools import PROJECT, ROOT, interpreter, quickly, run, uv

NEWCOMER = Path(__file__).with_name("newcomer")
PYTORCH = ("sb3", "sbx", "torchrl")
"""Extras that bring PyTorch, on Linux with 3 GB of CUDA's libraries: a part of their own."""
NEWER = ("3.14",)
"""Pythons of which it is only said that versions are found."""
SEVERAL = ("all", "release")
"""All at once, and what runs this."""
FORBIDDEN = ("torch", "tensorflow")
"""What no light extra may bring."""


def extras() -> list[str]:
    """All of pyproject.toml's."""
    return list(PROJECT["optional-dependencies"])


def light() -> list[str]:
    """Those that are installed one by one."""
    return [name for name in extras() if name not in (*PYTORCH, *SEVERAL)]


def environment(python: str, folder: Path) -> Path:
    """A new environment; its interpreter."""
    run(uv(), "venv", "--quiet", "--no-project", "--python", interpreter(python), folder)
    return folder / "bin" / "python"


def program(name: str) -> Path:
    """What a newcomer does with an extra; where nothing is written for it, with the core."""
    own = NEWCOMER / f"{name}.py"
    return own if own.exists() else NEWCOMER / "core.py"


def use(python: Path, name: str, say: Say) -> None:
    """Say what was installed, refuse PyTorch where it was not asked for, run the program.

    It runs in an empty folder, with warnings as they are. It compiles as `make test` does, and what
    it compiles is kept for the other environments of this run that have the same jaxlib.
    """
    listed = run(uv(), "pip", "list", "--python", python, "--format", "freeze").splitlines()
    files = [path for path in python.parents[1].rglob("*") if path.is_file()]
    say(f"{len(listed)} packages, {sum(path.stat().st_size for path in files) / 1e6:.0f} MB;")
    found = {line.partition("==")[0].lower() for line in listed}
    if name not in PYTORCH and (brought := found & set(FORBIDDEN)):
        raise FailedError(f"it brings {', '.join(sorted(brought))}, which it should not")
    home = python.parents[1] / "home"
    home.mkdir()
    programs = {
        "JAX_COMPILATION_CACHE_DIR": f"{python.parents[2] / 'programs'}",
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.1",
        "XLA_FLAGS": quickly(python),
    }
    run(python, "-I", program(name), cwd=home, variables=programs)


def install(version: str, name: str, given: tuple[Path, Path], backend: str, say: Say) -> None:
    """The wheel with an extra in an environment of its own, and its program."""
    wheel, here = given
    folder = here / f"{version}-{name}"
    try:
        python = environment(version, folder)
        wanted = f"{wheel}" if name == "core" else f"{wheel}[{name}]"
        build = ("--torch-backend", backend) if backend else ()
        run(uv(), "pip", "install", "--quiet", "--python", python, *build, wanted)
        use(python, name, say)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def each(
    version: str, names: list[str], wheel: Path, here: Path, backend: str = ""
) -> Iterator[Check]:
    """The wheel with each extra (`core`: none)."""
    for name in names:
        own = backend if name in PYTORCH else ""
        yield Check(name, version, partial(install, version, name, (wheel, here), own))


def compiled(version: str, *arguments: str | Path) -> str:
    """Versions that fit together."""
    given = [uv(), "pip", "compile", "--quiet", "--no-header", "--python", interpreter(version)]
    return run(*given, *arguments, ROOT / "pyproject.toml")


def resolve(version: str, name: str, say: Say) -> None:
    """Newest versions are found."""
    said = compiled(version, "--extra", name)
    if not re.search(r"(?m)^jax==", said):
        raise FailedError(f"no jax among\n{said}")
    say(f"{len(re.findall(r'(?m)^[^ ]+==', said))} packages,")


def pinned(version: str, say: Say) -> None:
    """Everything that development installs is pinned."""
    asked = ["--no-annotate", "--extra", "all", "--extra", "sb3", "-c", ROOT / "constraints.txt"]
    found = compiled(version, *asked)
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    known = {line.lower().replace("_", "-") for line in lines if not line.startswith("#")}
    if loose := [line for line in found.splitlines() if line.split(" ")[0] not in known]:
        raise FailedError("not pinned in constraints.txt:\n" + "\n".join(loose))
    say(f"{len(found.splitlines())} packages,")


def wheels(version: str, name: str, say: Say) -> None:
    """On a Python that is not there: newest versions are found, and nothing is to be compiled."""
    given = [uv(), "pip", "compile", "--quiet", "--no-header", "--only-binary", ":all:"]
    extra = () if name == "core" else ("--extra", name)
    run(*given, "--python-version", version, *extra, ROOT / "pyproject.toml")
    say("wheels alone,")


def on_newer() -> Iterator[Check]:
    """Versions on Pythons on which nothing is run."""
    for version in NEWER:
        for name in ("core", *PYTORCH, "all"):
            yield Check(f"versions of {name}", version, partial(wheels, version, name))


def resolved(version: str) -> Iterator[Check]:
    """Versions of what is not installed one by one."""
    for name in (*PYTORCH, "all"):
        yield Check(f"versions of {name}", version, partial(resolve, version, name))
    yield Check("versions of constraints.txt", version, partial(pinned, version))
