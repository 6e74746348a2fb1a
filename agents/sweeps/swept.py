"""Axes of a sweep: numbers of a machine's task, by dotted names, with units, and their values."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import nearest, require_kind, require_number, reraise, shown
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
        others = [one for one in (*known, *first, *self.aliases) if one != name]
        near = nearest(name, others)
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


RANGE, MOST_VALUES = re.compile(r"([^:]+):([^:]+):(\d{1,18})(:log)?"), 10**6
FORMS = "LOW:HIGH:N (even), LOW:HIGH:N:log, or values as 0.1,0.2,0.5"

AxisLike: TypeAlias = "str | float | Iterable[float]"
"""Accepted forms of an axis: its text, one value or several."""


def axis_values(given: AxisLike) -> tuple[float, ...]:
    """The values of an axis from a text (see FORMS), a number or several. ValueError otherwise."""
    if isinstance(given, str) and ":" in given:
        return _range(given)
    if isinstance(given, str):
        given = [_number(one, given) for one in given.split(",")]
    values = np.atleast_1d(np.asarray(list(given) if isinstance(given, Iterable) else given))
    require_number("values", values, accepted="finite numbers, at least one")
    if len(set(values.tolist())) < values.size:
        raise ValueError(f"values = {shown(values.tolist())}; accepted: each value once")
    return tuple(map(float, values))


def _range(text: str) -> tuple[float, ...]:
    found = RANGE.fullmatch(text)
    if found is None:
        raise ValueError(f"{shown(text)} is no axis; accepted: {FORMS}")
    low, high, log = _number(found[1], text), _number(found[2], text), bool(found[4])
    count = int(found[3])
    good = -math.inf < low < high < math.inf and (low > 0 or not log)
    if not good or not 2 <= count <= MOST_VALUES:
        accepted = f"finite LOW < HIGH, LOW > 0 with log, 2 to {MOST_VALUES:,} values"
        raise ValueError(f"{shown(text)}; accepted: {accepted}")
    return tuple((np.geomspace if log else np.linspace)(low, high, count).tolist())


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{shown(text)} in {shown(whole)} is no number; accepted: {FORMS}"
        ) from None


def axes_of(given: Mapping[str, AxisLike]) -> dict[str, tuple[float, ...]]:
    """Values of axes by name. ValueError naming the axis."""
    require_kind("axes", given, Mapping, 'a dict of axes by name, {"mu": "0.02:0.3:64"} or such')
    found = {}
    for name, values in given.items():
        with reraise(f"axis {name}: "):
            found[str(name)] = axis_values(values)
    return found


def values_at(axes: Mapping[str, tuple[float, ...]], points: np.ndarray) -> dict[str, np.ndarray]:
    """The axes' values at points by their flat indices, the last axis fastest, in float64."""
    places = np.unravel_index(points, tuple(map(len, axes.values())) or (1,))
    pairs = zip(axes.items(), places, strict=False)
    return {name: np.asarray(values)[place] for (name, values), place in pairs}
