"""Every public name of the package: each `__all__`, and where each name is written.

Read from the source, as mkdocstrings reads the rest: nothing is imported for it.
"""

from __future__ import annotations

import ast
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Module:
    """A module, its first docstring line, and its public names with the paths of their origins."""

    name: str
    about: str
    origins: dict[str, str]


@cache
def folders() -> dict[str, Path]:
    """Folders of the package by the names of its subpackages."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return {
        name: ROOT / folder for name, folder in table["tool"]["setuptools"]["package-dir"].items()
    }


@cache
def sources() -> dict[str, Path]:
    """Files of all modules by dotted name; a package's is its `__init__.py`."""
    found = {}
    for package, folder in folders().items():
        for file in sorted(folder.glob("*.py")):
            found[package if file.stem == "__init__" else f"{package}.{file.stem}"] = file
    return found


@cache
def public_modules() -> list[Module]:
    """All modules of the layers with an `__all__`, the upper ones first; the command line's is no
    one's to import."""
    order = [f"stickslip.{layer}" for layer in ("envs", "agents", "optim", "dynamics")]
    found = []
    for name in sources():
        names = _listed(_tree(name))
        if names is not None and _layer(name) in order:
            about = ast.get_docstring(_tree(name)) or ""
            origins = {one: origin(name, one) for one in sorted(names, key=str.lower)}
            found.append(Module(name, about.partition("\n\n")[0].replace("\n", " "), origins))
    return sorted(
        found, key=lambda one: (_depth(one.name), order.index(_layer(one.name)), one.name)
    )


def homes() -> dict[str, str]:
    """The module that documents each origin: the first of those that make it public."""
    found: dict[str, str] = {}
    for module in public_modules():
        for path in module.origins.values():
            found.setdefault(path, module.name)
    return found


def origin(module: str, name: str) -> str:
    """The dotted path under which a module's name is written, imports followed."""
    for node in ast.walk(_tree(module)):
        if isinstance(node, ast.ImportFrom) and node.module in sources():
            for one in node.names:
                if (one.asname or one.name) == name:
                    if f"{node.module}.{one.name}" in sources():
                        return f"{node.module}.{one.name}"
                    return origin(node.module, one.name)
    return f"{module}.{name}"


def _listed(tree: ast.Module) -> list[str] | None:
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return ast.literal_eval(node.value)
    return None


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(sources()[module].read_text(encoding="utf-8"))


def _depth(name: str) -> int:
    return name.count(".")


def _layer(name: str) -> str:
    return ".".join(name.split(".")[:2])
