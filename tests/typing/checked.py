"""A pytest plugin under which what signatures say is checked at every call: types and shapes.

`make test-shapes` runs it: python -m pytest -p tests.typing.checked tests/... What is imported for
type checkers alone is imported in earnest; a package's lazy names stay lazy.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, SourceFileLoader
from typing import Any, runtime_checkable

from beartype import BeartypeConf, beartype
from beartype.roar import BeartypeDecorHintException
from jaxtyping import jaxtyped

FUNCTIONS: list[Callable[..., Any]] = []
"""All that is checked, without its checks."""
UNREAD: list[str] = []
"""Annotations with a shape that mean nothing where they stand, and so are not checked."""
NAME = "_checked_at_run_time"

_whole_numbers_are_numbers = beartype(conf=BeartypeConf(is_pep484_tower=True))


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function with its arguments and its result held to their annotations at every call."""
    FUNCTIONS.append(function)
    for name, said in function.__annotations__.items():
        if isinstance(said, str) and '"' in said:
            try:
                eval(said, function.__globals__)
            except Exception as error:  # noqa: BLE001, whatever a library raises
                where = f"{function.__module__}.{function.__qualname__}"
                UNREAD.append(f"{where}, {name}: {said} ({error})")
    try:
        return jaxtyped(function, typechecker=_whole_numbers_are_numbers)
    except BeartypeDecorHintException:  # Self, or a named tuple of some type
        function.__annotations__.pop("return")
        return jaxtyped(function, typechecker=_whole_numbers_are_numbers)


class InEarnest(ast.NodeTransformer):
    """Decorates functions; unpacks `if TYPE_CHECKING:` where it has no else."""

    def visit_If(self, node: ast.If) -> Any:
        self.generic_visit(node)
        for_checkers = isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
        return node.body if for_checkers and not node.orelse else node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.generic_visit(node)
        every = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
        stub = "overload" in map(ast.unparse, node.decorator_list)
        if not stub and (node.returns or any(one.annotation for one in every)):
            node.decorator_list.append(ast.Name(NAME, ast.Load(), lineno=node.lineno, col_offset=0))
        return node

    def visit_ClassDef(self, node: ast.ClassDef) -> ast.ClassDef:
        self.generic_visit(node)
        if any("Protocol" in ast.unparse(base) for base in node.bases):
            name = f"{NAME}_protocol"
            node.decorator_list.append(ast.Name(name, ast.Load(), lineno=node.lineno, col_offset=0))
        return node


class Loader(SourceFileLoader):
    """Compiles the rewritten source, and keeps nothing of it on disk."""

    def get_code(self, fullname: str) -> Any:
        path = self.get_filename(fullname)
        tree = InEarnest().visit(ast.parse(self.get_data(path), path))
        return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True)

    def exec_module(self, module: Any) -> None:
        vars(module).update({NAME: checked, f"{NAME}_protocol": runtime_checkable})
        super().exec_module(module)


class Finder(MetaPathFinder):
    """Finds stickslip's modules where everybody else finds them."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if fullname.split(".")[0] != "stickslip":
            return None
        for other in sys.meta_path:
            spec = None if other is self else other.find_spec(fullname, path, target)
            if spec is not None:
                if isinstance(spec.loader, SourceFileLoader):
                    spec.loader = Loader(spec.loader.name, spec.loader.path)
                return spec
        return None


if "stickslip" in sys.modules:
    raise RuntimeError("stickslip is imported already: name this plugin first, with -p")
sys.meta_path.insert(0, Finder())
