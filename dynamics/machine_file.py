"""Files of a machine in TOML: numbers in SI units, or texts with their units, as "40 mm"."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.dynamics.checks import require_known, shown

MOST_BYTES = 1_000_000
"""Of a file."""
QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*([^\d\s].*?)\s*")
"""A number and the unit behind it."""
UNIT = re.compile(r"(?:[A-Za-zµΩ°%·*/^() ]|(?<=[\^*])-?\d){1,60}")
"""Characters of a unit: no arithmetic but of powers."""

Table = Mapping[str, Any]
"""A table of TOML."""


def read_machine(path: str | Path, machine: str, tables: tuple[str, ...]) -> dict[str, Any]:
    """The tables of a machine's file. ValueError for a file that is none, or another machine's.

    machine: what the file's `machine` must say where it says something. tables: the accepted names
    beside it.
    """
    place = Path(path)
    if not place.is_file():
        raise ValueError(f"{place}: no such file; accepted: a machine's file in TOML")
    if place.stat().st_size > MOST_BYTES:
        raise ValueError(f"{place} is larger than {MOST_BYTES} bytes; accepted: a machine's file")
    try:
        found = tomllib.loads(place.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"{place} is not TOML: {error}") from None
    named = found.pop("machine", machine)
    if named != machine:
        raise ValueError(f"{place}: machine = {shown(named)}; accepted: {machine!r}")
    require_known(found, tables, f"entry of {place}")
    return found


@contextmanager
def in_file(path: str | Path | None) -> Iterator[None]:
    """Put the file's name before the message of a ValueError."""
    try:
        yield
    except ValueError as error:
        raise ValueError(str(error) if path is None else f"{path}: {error}") from None


def table_of(tables: Table, name: str) -> dict[str, Any]:
    """A table by name, empty where there is none. ValueError for anything else under the name."""
    found = tables.get(name, {})
    if not isinstance(found, dict):
        raise ValueError(f"{name} = {shown(found)}; accepted: a table, [{name}]")
    return found


def numbers_of(table: Table, units: Mapping[str, str], name: str) -> dict[str, float]:
    """The numbers of a table in SI units, by their units' table. ValueError naming the entry."""
    require_known(table, units, f"entry of [{name}]")
    return {key: quantity(f"{name}.{key}", value, units[key]) for key, value in table.items()}


def quantity(name: str, value: Any, unit: str) -> float:
    """A number in the SI unit, or a text with its own unit, in the SI unit. Decimal, so that
    "700 g" is the number 0.7. unit: "" for a plain number."""
    accepted = f"a number [{unit}], or a text with its unit" if unit else "a number"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    found = QUANTITY.fullmatch(value) if isinstance(value, str) and len(value) < 100 else None
    if found is None or not UNIT.fullmatch(found[2]):
        raise ValueError(f"{name} = {shown(value)}; accepted: {accepted}")
    import pint

    try:
        given = _registry().Quantity(Decimal(found[1]), found[2])
        return float(given.to(unit).magnitude)
    except (pint.PintError, ArithmeticError, ValueError, TypeError, AttributeError):
        raise ValueError(
            f"{name} = {shown(value)} is not in {unit or 'a number'}; accepted: {accepted}"
        ) from None


def number_or_text(value: Any) -> Any:
    """The number of a text that is one, anything else as it is."""
    try:
        return float(value)
    except (TypeError, ValueError):
        return value


@cache
def _registry() -> Any:
    """pint's units. About 0.4 s at the first use."""
    import pint

    return pint.UnitRegistry(non_int_type=Decimal)


def toml_text(tables: Mapping[str, Any], about: str = "") -> str:
    """Tables of numbers, texts and lists of numbers as TOML; `about` as comments above."""
    lines = [f"# {line}".rstrip() for line in about.splitlines()]
    nested = {name: one for name, one in tables.items() if isinstance(one, Mapping)}
    lines += [f"{name} = {_literal(one)}" for name, one in tables.items() if name not in nested]
    for name, table in nested.items():
        inner = {key: one for key, one in table.items() if isinstance(one, Mapping)}
        blocks = {f"{name}.{key}": one for key, one in inner.items()} or {name: table}
        for head, entries in blocks.items():
            lines += [
                "",
                f"[{head}]",
                *(f"{key} = {_literal(one)}" for key, one in entries.items()),
            ]
    return "\n".join(lines) + "\n"


def _literal(value: Any) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_literal, value))}]"
    return str(np.asarray(value)[()])  # the shortest digits in the value's own precision
