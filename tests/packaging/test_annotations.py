"""How much of each layer a type checker is told nothing about; it may only become less.

Counted are uses of Any, or of Numeric, which is Any by another name, and arguments without a type.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
MOST = {
    "dynamics": (222, 72),
    "optim": (139, 8),
    "envs": (192, 4),
    "agents": (77, 0),
    "src": (59, 0),
}
"""Of each layer: uses of Any, arguments without a type."""


def signatures(tree: ast.AST, in_class: bool = False) -> Iterator[list[ast.arg]]:
    """The arguments of each function, without self and cls; nested ones, too."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef):
            given = [*node.args.posonlyargs, *node.args.args]
            bound = in_class and "staticmethod" not in map(ast.unparse, node.decorator_list)
            others = (*node.args.kwonlyargs, node.args.vararg, node.args.kwarg)
            yield given[bound:] + [one for one in others if one is not None]
        yield from signatures(node, isinstance(node, ast.ClassDef))


def untold(layer: str) -> tuple[int, int]:
    """Uses of Any, and arguments without a type."""
    anything, bare = 0, 0
    for path in (ROOT / layer).rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = (node.id for node in ast.walk(tree) if isinstance(node, ast.Name))
        anything += sum(name in ("Any", "Numeric") for name in names)
        bare += sum(one.annotation is None for found in signatures(tree) for one in found)
    return anything, bare


@pytest.mark.parametrize("layer", MOST)
def test_checkers_are_told_no_less_than_before(layer: str):
    found, most = untold(layer), MOST[layer]
    assert found[0] <= most[0], f"{found[0]} uses of Any or Numeric"
    assert found[1] <= most[1], f"{found[1]} arguments without a type"
