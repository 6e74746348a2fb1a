"""Numbers of a machine's task that a sweep may vary, by dotted names, with units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, ClassVar, TypeAlias

import numpy as np

from stickslip.dynamics.checks import nearest, shown
from stickslip.dynamics.numeric import float_type

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from jaxtyping import PyTree

    from stickslip.dynamics.numeric import Number

Path: TypeAlias = tuple["str | int", ...]
"""Names of fields and places in tuples and arrays, from the root of a tree to a number."""
MOST_ENTRIES = 64
"""Larger arrays are not set number by number."""
LISTED = 24
"""Names in a message."""


class Swept:
    """Parameters of a machine's task that axes may set; the default does for most machines.

    A name is dotted, as "task.mass", or its last part where the order of `parts` makes it unique.
    """

    units: ClassVar[Mapping[str, str]] = {}
    """Of fields, by their dotted name without array indices, or by its last word."""
    kept: ClassVar[Mapping[str, str]] = {"reward": "-", "duration": "s"}
    """Columns that are written of an episode, of those that the machine's measures keep; units."""
    slip: ClassVar[tuple[str, str] | None] = None
    """Columns of the distance slid and of the distance travelled, where slip is of interest."""
    short: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """Names that set several fields at once."""

    def parts(self, params: PyTree) -> dict[str, PyTree]:
        """Trees of numbers by the first word of their names, the most important first."""
        return {"task": {one.name: getattr(params, one.name) for one in fields(params) if one.init}}

    def with_parts(
        self, params: PyTree, parts: Mapping[str, PyTree], names: Iterable[str]
    ) -> PyTree:
        """Replace the parts. names: dotted, of the fields that changed."""
        del names
        return replace(params, **parts["task"])

    def opened(self, params: PyTree, names: Iterable[str]) -> PyTree:
        """Give the parameters a structure that has a place for every named axis."""
        del names
        return params

    def require_within(self, params: PyTree) -> None:
        """Raise ValueError where the task does not take these concrete parameters."""

    def kept_units(self, env: PyTree) -> Mapping[str, str]:
        """`kept` of an environment."""
        del env
        return self.kept

    def unit(self, name: str) -> str:
        """Unit of a dotted name."""
        words = [word for word in name.split(".") if not word.isdigit()]
        return self.units.get(".".join(words), self.units.get(words[-1], "-"))

    def targets(self, params: PyTree, name: str) -> tuple[str, ...]:
        """The dotted fields that an axis sets. ValueError for an unknown name."""
        known = self.known(params)
        if name in self.short and all(one in known for one in self.short[name]):
            return self.short[name]
        if name in known:
            return (name,)
        if name not in self.short and (
            ends := [one for one in known if one.partition(".")[2] == name]
        ):
            return (ends[0],)
        shorter = dict.fromkeys(one.partition(".")[2] for one in known)
        near = nearest(name, [*known, *shorter, *self.short])
        first = [*self.short, *shorter][:LISTED]
        raise ValueError(
            f"axis {shown(name)} is unknown here{near}; accepted: {', '.join(first)}"
            f"{', ...' if len(shorter) > LISTED else ''}; or with the part in front: "
            f"{', '.join(f'{part}.NAME' for part in self.parts(params))}"
        )

    def known(self, params: PyTree) -> dict[str, Path]:
        """Paths of all fields that an axis may set, by their dotted names."""
        paths = _paths(self.parts(params), ())
        return {".".join(map(str, path)): path for path in paths if len(path) > 1}

    def put(self, params: PyTree, values: Mapping[str, Number]) -> PyTree:
        """Set fields, by dotted names, to numbers that may be traced."""
        import jax.numpy as jnp

        if not values:
            return params
        kind, parts, known = float_type(params), self.parts(params), self.known(params)
        for name, value in values.items():
            parts = _with_number(parts, known[name], jnp.asarray(value, kind))
        return self.with_parts(params, parts, values)


def _paths(tree: PyTree, so_far: Path) -> Iterator[Path]:
    """Paths of the numbers in dataclasses, tuples, dicts and arrays, without static fields."""
    if isinstance(tree, bool | np.bool_ | str) or tree is None:
        return
    if isinstance(tree, int | float | np.number):
        yield so_far
    elif hasattr(tree, "dtype"):
        if tree.dtype.kind == "f" and tree.size <= MOST_ENTRIES:
            yield from ((*so_far, *map(int, place)) for place in np.ndindex(tree.shape))
    else:
        for name in _entries(tree):
            yield from _paths(_entry(tree, name), (*so_far, name))


def _entries(tree: PyTree) -> Iterable[str | int]:
    """Names of the entries that hold numbers."""
    if isinstance(tree, dict):
        return tree
    if isinstance(tree, tuple):
        return getattr(tree, "_fields", range(len(tree)))
    if is_dataclass(tree):
        return [f.name for f in fields(tree) if f.init and not f.metadata.get("static")]
    return ()


def _entry(tree: PyTree, name: str | int) -> PyTree:
    return tree[name] if isinstance(tree, dict) or isinstance(name, int) else getattr(tree, name)


def _with_number(tree: PyTree, path: Path, value: Number) -> PyTree:
    """Copy the tree with another number at the path's end."""
    import jax.numpy as jnp

    if not path:
        return value
    if hasattr(tree, "dtype"):
        return jnp.asarray(tree).at[path].set(value)
    name = path[0]
    inner = _with_number(_entry(tree, name), path[1:], value)
    if isinstance(tree, dict):
        return tree | {name: inner}
    if isinstance(tree, tuple):
        values = [inner if one == name else _entry(tree, one) for one in _entries(tree)]
        return type(tree)(*values) if hasattr(tree, "_fields") else tuple(values)
    return replace(tree, **{str(name): inner})
