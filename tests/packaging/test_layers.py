"""Imports, inside functions too, point one way: dynamics, optim, envs, agents, the front door."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.documents import ROOT
from tests.extras import IMPORT_NAMES

# Layer -> (folder, parts of stickslip it may import besides itself, packages it may import).
# None stands for everything that pyproject.toml declares.
FRONT = "stickslip"
RULES: dict[str, tuple[str, set[str], set[str] | None]] = {
    "records": ("src/stickslip/records", set(), {"numpy"}),
    "dynamics": ("dynamics", {"records"}, {"jax", "numpy", "scipy", "pint"}),
    "optim": ("optim", {"records", "dynamics"}, {"jax", "numpy", "cvxpy", "scipy", "cma", "tqdm"}),
    "envs": ("envs", {"records", "dynamics", "optim"}, None),
    "agents": ("agents", {"records", "dynamics", "optim", "envs"}, None),
    FRONT: ("src/stickslip", {"records", "dynamics", "optim", "envs", "agents"}, None),
}
IMPLIED = {"scipy", "torch", "jaxlib"}  # by cvxpy and jax; by stable-baselines3; by jax
ELSE_WITHOUT = {"zstandard", "compression"}
"""What JAX packs programs with where it is there; the standard library has one from 3.14 on."""

# Packages an environment has no business with, and that would make a step depend on a solver.
ENVS_NEVER = {"cvxpy", "scipy", "torch", "rich", "tqdm"}


def declared_packages() -> set[str]:
    """Import names of the dependencies, core and for running (not for development)."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    lines = [*project["dependencies"], *extras["train"], *extras["viz"], *extras["bench"]]
    lines += [*extras["optim"], *extras["sweep"], *extras["onnx"], *extras["optimisers"]]
    lines += [*extras["data"], *extras["sb3"]]
    names = {re.split(r"[\[<>=!~; ]", line, maxsplit=1)[0] for line in lines}
    return {IMPORT_NAMES.get(name, name) for name in names} | IMPLIED | ELSE_WITHOUT


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)


def imports(tree: ast.AST, typing_only: bool = False) -> Iterator[tuple[str, int, bool]]:
    """(dotted name, line, behind TYPE_CHECKING?) of every import; `from a import b` gives a.b."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, node.lineno, typing_only) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from ((name, node.lineno, typing_only) for name in names)
        else:
            yield from imports(node, typing_only or is_type_checking(node))


def allowed(layer: str, name: str, typing_only: bool) -> bool:
    """True when a module of `layer` may import `name`."""
    _, parts, packages = RULES[layer]
    package, *rest = name.split(".")
    if package == "stickslip":
        return layer == FRONT or (bool(rest) and rest[0] in parts | {layer})
    if package in sys.stdlib_module_names or (typing_only and package == "jaxtyping"):
        return True
    if layer == "envs" and package in ENVS_NEVER:
        return False
    return package in (declared_packages() if packages is None else packages)


@pytest.mark.parametrize("layer", RULES)
def test_layer_imports_only_what_it_may(layer: str):
    wrong = []
    for path in sorted((ROOT / RULES[layer][0]).rglob("*.py")):
        for name, line, typing_only in imports(ast.parse(path.read_text(encoding="utf-8"))):
            if not allowed(layer, name, typing_only):
                wrong.append(f"{path.relative_to(ROOT)}:{line} imports {name}")
    assert wrong == []


def modules() -> dict[str, Path]:
    """Every module of the package but the folders' own `__init__`, by its dotted name."""
    found = {}
    for layer, (folder, _, _) in RULES.items():
        for path in (ROOT / folder).rglob("*.py"):
            parts = path.relative_to(ROOT / folder).with_suffix("").parts
            own = () if layer == FRONT else (layer,)
            if path.name != "__init__.py":
                found[".".join((FRONT, *own, *parts))] = path
    return found


def leads_to(known: dict[str, Path]) -> dict[str, set[str]]:
    """The modules that each of them imports, for types or inside functions, too."""
    found = {}
    for name, path in known.items():
        found[name] = set()
        for dotted, _, _ in imports(ast.parse(path.read_text(encoding="utf-8"))):
            for whole in (dotted, dotted.rpartition(".")[0]):
                if whole in known and whole != name:
                    found[name].add(whole)
    return found


def circle(graph: dict[str, set[str]]) -> list[str]:
    """Names that lead round to the first of them, or nothing."""
    done: set[str] = set()

    def walk(name: str, way: list[str]) -> list[str]:
        if name in way:
            return [*way[way.index(name) :], name]
        if name not in done:
            for following in sorted(graph[name]):
                if round_ := walk(following, [*way, name]):
                    return round_
            done.add(name)
        return []

    return next((found for name in sorted(graph) if (found := walk(name, []))), [])


def test_no_file_leads_round_to_itself():
    graph = leads_to(modules())
    assert len(graph) > 150
    assert sum(map(len, graph.values())) > 500
    assert circle(graph) == []


ROOMS = {
    "dynamics": ("biped", "ugv"),
    "optim": ("gait", "posture", "instances.biped", "instances.ugv"),
    "envs": ("biped", "ugv"),
    "agents": ("biped", "ugv"),
}
"""Folders of a layer that know what a machine is; no other file of the layer does."""
BUILT_ON = {"instances.biped": {"gait"}, "instances.ugv": {"posture"}}
"""Rooms of a machine that may use what else its layer knows of it."""


def room_of(module: str) -> tuple[str, str] | None:
    """Layer and machine's room that a module is in, if it is in one."""
    for layer, rooms in ROOMS.items():
        for room in rooms:
            if f"{module}.".startswith(f"{FRONT}.{layer}.{room}."):
                return layer, room
    return None


def test_shared_files_import_no_machine_and_machines_not_each_other():
    known = modules()
    assert {room_of(name) for name in known} - {None} == {
        (layer, room) for layer, rooms in ROOMS.items() for room in rooms
    }
    wrong = []
    for name, found in leads_to(known).items():
        layer, own = name.split(".")[1], room_of(name)
        if layer not in ROOMS:
            continue
        for one in found:
            other = room_of(one)
            same_layer = other is not None and other[0] == layer
            machines_meet = own and other and own[1].split(".")[-1] != other[1].split(".")[-1]
            machines_meet = machines_meet and other[1] not in BUILT_ON.get(own[1], ())
            if same_layer and (own is None or machines_meet):
                wrong.append(f"{name} imports {one}")
    assert wrong == []
