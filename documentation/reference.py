"""The API reference: a page for each module with an `__all__`, and the folder that is read for it.

Every name is documented once, where it is shortest to import from; other modules that make it
public link there.
"""

from __future__ import annotations

import re

from documentation.names import ROOT, Module, homes, public_modules, sources

PACKAGE = ROOT / "build" / "reference"
"""Links to the sources that lie as in the installed package, for mkdocstrings to read."""
LINK = re.compile(r"build/reference/stickslip/[\w/]+\.py")

BEHIND = ("---", "search:", "  boost: 0.3", "---", "")
"""What puts a page behind the written ones where both hold what is searched for."""


def lay_out() -> None:
    """Make the folder of links; what has gone from the sources goes from it."""
    wanted = {}
    for name, file in sources().items():
        parts = name.split(".") + (["__init__"] if file.stem == "__init__" else [])
        wanted[PACKAGE.joinpath(*parts).with_suffix(".py")] = file
    for link in PACKAGE.rglob("*.py"):
        if link not in wanted:
            link.unlink()
    for link, file in wanted.items():
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.is_symlink():
            link.symlink_to(file)


def pages() -> dict[str, str]:
    """Markdown by path below docs."""
    return {f"api/{page(module.name)}": _page(module) for module in public_modules()}


def with_real_paths(html: str) -> str:
    """Links of the folder named as the files that they lead to."""
    return LINK.sub(lambda link: (ROOT / link[0]).resolve().relative_to(ROOT).as_posix(), html)


def page(module: str) -> str:
    """The file of a module's page."""
    return module.removeprefix("stickslip.").replace(".", "_") + ".md"


def _page(module: Module) -> str:
    own, other = [], []
    for name, path in module.origins.items():
        (own if homes()[path] == module.name else other).append((name, path))
    lines = [*BEHIND, f"# {module.name}", "", module.about, ""]
    if other:
        lines += ["Documented elsewhere: " + ", ".join(_link(*one) for one in other) + ".", ""]
    for _, path in own:
        lines += [f"::: {path}", ""]
    return "\n".join(lines)


def index() -> str:
    """A table of all modules and their names."""
    lines = ["| module | what it holds | names |", "| --- | --- | --- |"]
    for module in public_modules():
        names = ", ".join(_link(*one) for one in module.origins.items())
        lines.append(f"| [{module.name}](api/{page(module.name)}) | {module.about} | {names} |")
    return "\n".join(lines)


def _link(name: str, path: str) -> str:
    return f"[`{name}`][{path}]"
