"""Numbers of a machine's task that a sweep may vary, by dotted names, with units."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import nearest, shown
from stickslip.dynamics.pytrees import Number, float_type

if TYPE_CHECKING:
    from jaxtyping import PyTree


MOST_ENTRIES = 64
"""Larger arrays are not set number by number."""
LISTED = 24
"""Names in a message."""


def _parts(params: PyTree) -> dict[str, PyTree]:
    """The fields that are no static choices."""
    numbers = (one for one in fields(params) if one.init and not one.metadata.get("static"))
    return {"task": {one.name: getattr(params, one.name) for one in numbers}}


@dataclass(frozen=True)
class Swept:
    """Parameters of a machine's task that axes may set; the default does for most machines.

    A name is dotted, as "task.mass", or its last part where the order of `parts` makes it unique.
    """

    units: Mapping[str, str] = field(default_factory=dict)
    """Units of fields, by their dotted name without array indices, or its first or last word."""
    slip: tuple[str, str] | None = None
    """Columns of the distance slid and of the distance travelled, where slip is of interest."""
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Other names of fields, by which several may be set at once; those with a dot, of `--set`."""
    parts: Callable[[PyTree], dict[str, PyTree]] = _parts
    """Pytrees of numbers by the first word of their names, the most important first."""
    with_parts: Callable[[PyTree, Mapping[str, PyTree], Mapping[str, Number]], PyTree] = (
        lambda params, parts, values: replace(params, **parts["task"])
    )
    """Replace the parts of parameters. values: by the dotted names of the fields that changed."""
    opened: Callable[[PyTree, Collection[str]], PyTree] = lambda params, names: params
    """Give the parameters a structure that has a place for every named axis."""

    def unit(self, name: str) -> str:
        """Unit of a dotted name."""
        words = [word for word in name.split(".") if not word.isdigit()]
        part = self.units.get(words[0], self.units.get(words[-1], "-"))
        return self.units.get(".".join(words), part)

    def targets(self, params: PyTree, name: str) -> tuple[str, ...]:
        """The dotted fields that an axis sets. ValueError for an unknown name."""
        known = self.known(params)
        if name in known:
            return (name,)
        if name in self.aliases:
            if set(self.aliases[name]) <= set(known):
                return self.aliases[name]
        elif name in (shorter := {one.partition(".")[2]: one for one in reversed(known)}):
            return (shorter[name],)
        short = [one for one in self.aliases if "." not in one]
        first = list(dict.fromkeys([*short, *(one.partition(".")[2] for one in known)]))
        near = nearest(name, [*known, *first, *self.aliases])
        raise ValueError(
            f"{shown(name)} is no number of this task{near}; accepted: "
            f"{', '.join(first[:LISTED])}{', ...' if len(first) > LISTED else ''}; or with the "
            f"part in front: {', '.join(f'{part}.NAME' for part in self.parts(params))}"
        )

    def known(self, params: PyTree) -> list[str]:
        """Dotted names of all numbers that an axis may set."""
        leaves = (
            pair
            for part, tree in self.parts(params).items()
            for pair in jax.tree_util.tree_leaves_with_path({part: tree})
        )
        return [name for path, leaf in leaves for name, _ in _entries(path, leaf)]

    def changed(self, params: PyTree, values: Mapping[str, Number]) -> PyTree:
        """The parameters with numbers set by the names of axes.

        ValueError for unknown names, and for values out of the task's range.
        """
        params = self.opened(params, values)
        targets = {one: values[name] for name in values for one in self.targets(params, name)}
        try:
            made = self.put(params, targets)
            return made.validate() if values and hasattr(made, "validate") else made
        except ValueError as error:
            where = ", ".join(f"{name} = {value:g}" for name, value in values.items())
            raise ValueError(f"at {where}: {error}") from error

    def put(self, params: PyTree, values: Mapping[str, Number]) -> PyTree:
        """Set fields, by dotted names, to numbers that may be traced."""
        if not values:
            return params
        kind, leaves = float_type(params), []
        pairs, structure = jax.tree_util.tree_flatten_with_path(self.parts(params))
        for path, leaf in pairs:
            for name, place in _entries(path, leaf):
                if name in values:
                    value = jnp.asarray(values[name], kind)
                    leaf = jnp.asarray(leaf).at[place].set(value) if place else value
            leaves.append(leaf)
        return self.with_parts(params, jax.tree.unflatten(structure, leaves), values)


def _entries(path: tuple, leaf: PyTree) -> Iterator[tuple[str, tuple[int, ...]]]:
    """Dotted name and indices of every number in a leaf; none of integer and large arrays."""
    name = jax.tree_util.keystr(path, simple=True, separator=".")
    if isinstance(leaf, bool):
        return
    if isinstance(leaf, int | float | np.number):
        yield name, ()
    elif hasattr(leaf, "dtype") and leaf.dtype.kind == "f" and leaf.size <= MOST_ENTRIES:
        for place in np.ndindex(leaf.shape):
            yield ".".join((name, *map(str, place))), place
