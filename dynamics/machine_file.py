"""Files of a machine in TOML: numbers in SI units, or texts with their units, as "40 mm".

A number has a dotted name, tables first: `bars.femur`, `links.tibia.mass`; the parts of a pair are
`links.tibia.centre.0` and `.1`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from decimal import Decimal
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from stickslip.dynamics.checks import require_known, require_that, reraise, shown

Changes: TypeAlias = Mapping[str, Any]
"""Numbers by dotted names."""
MOST_BYTES = 1_000_000
"""Of a file."""
QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*([^\d\s].*?)\s*")
"""A number and the unit behind it."""
UNIT = re.compile(r"(?:[A-Za-zµΩ°%·*/^() ]|(?<=[\^*])-?\d){1,60}")
"""Characters of a unit: no arithmetic but of powers."""


class MachineFile(NamedTuple):
    """Numbers that the file of a machine may have.

    machine: "biped" or "ugv"; called: its name in messages. units: SI unit by dotted name; the name
    of another number where a plain number is a multiple of that one. names: dotted name of the file
    by the name that changes give (`--set`). usual: numbers that others are multiples of.
    """

    machine: str
    called: str
    units: Mapping[str, str]
    names: Mapping[str, str]
    usual: Mapping[str, float]

    def read(self, path: str | Path | None, changes: Mapping[str, Any]) -> dict[str, float]:
        """The numbers of a file by dotted name, some of them changed; None: only the changes.

        path: also the text itself, which has several lines. ValueError naming the file, the entry,
        the value and what is accepted.
        """
        require_known(changes, self.names, f"number of a {self.called}")
        given: dict[str, Any] = dict(self.usual)
        with in_file(path):
            tables = {} if path is None else _parsed(path)
            named = tables.pop("machine", self.machine)
            require_that(named == self.machine, "machine", named, repr(self.machine))
            found = self._numbers(given | _flat(tables))
        changed = {self.names[name]: _number_or_text(value) for name, value in changes.items()}
        return self._numbers(found | changed) if changed else found

    def _numbers(self, given: Mapping[str, Any]) -> dict[str, float]:
        return {name: self._number(name, given) for name in given}

    def _number(self, name: str, given: Mapping[str, Any]) -> float:
        if name not in self.units:
            heads = f"{name}.", name.rpartition(".")[0] + "."
            near = [[one for one in self.units if one.startswith(head)] for head in heads]
            tables = {one.partition(".")[0] for one in self.units}
            require_known([name], near[0] or near[1] or sorted(tables), "number of the file")
        value, unit = given[name], self.units[name]
        if unit not in self.units:
            return quantity(name, value, unit)
        if not isinstance(value, str):
            return quantity(name, value, "")
        return quantity(name, value, self.units[unit]) / (self._number(unit, given) or np.nan)


class OwnMachine(NamedTuple):
    """A machine of a file, and the numbers of its motor, named as arguments of the environment."""

    params: Any
    motor: dict[str, float]


def table_of(numbers: Mapping[str, float], name: str) -> dict[str, float]:
    """The numbers of one table, by the rest of their names."""
    head = f"{name}."
    return {key[len(head) :]: one for key, one in numbers.items() if key.startswith(head)}


def machine_in(path: str | Path) -> Any:
    """What a file's `machine` says, "biped" where it says nothing."""
    with in_file(path):
        return _parsed(path).get("machine", "biped")


def _parsed(path: str | Path) -> dict[str, Any]:
    """The tables of a machine's file or text."""
    try:
        return tomllib.loads(str(path) if _is_text(path) else _text_of(Path(path)))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ValueError(f"the file is not TOML: {error}") from None


def _is_text(path: str | Path) -> bool:
    return "\n" in str(path)


def _text_of(path: Path) -> str:
    if not path.is_file():
        what = "is no plain file" if path.exists() else "no such file"
        what = "is a directory" if path.is_dir() else what
        raise ValueError(f"{what}; accepted: a machine's file in TOML")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"larger than {MOST_BYTES} bytes; accepted: a machine's file")
    return path.read_text(encoding="utf-8")


def _flat(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Values by dotted name; the two values of a pair apart."""
    found: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, list) and len(value) == 2:
            value = dict(zip("01", value, strict=True))
        if isinstance(value, Mapping):
            found |= _flat(value, f"{before}{key}.")
        else:
            found[f"{before}{key}"] = value
    return found


@contextmanager
def in_file(path: str | Path | None) -> Iterator[None]:
    """Put the file's name before the message of a ValueError."""
    with reraise("" if path is None or _is_text(path) else f"{path}: "):
        yield


def quantity(name: str, value: Any, unit: str) -> float:
    """A number in the SI unit, or a text with its own unit, in the SI unit. Decimal, so that
    "700 g" is the number 0.7. unit: "" for a plain number."""
    accepted = f"a number [{unit}], or a text with its unit" if unit else "a number"
    if isinstance(value, int | float) and not isinstance(value, bool):
        with suppress(OverflowError):
            return float(value)
    found = QUANTITY.fullmatch(value) if isinstance(value, str) and len(value) < 100 else None
    if found is None or not UNIT.fullmatch(found[2]):
        raise ValueError(f"{name} = {shown(value)}; accepted: {accepted}")
    import pint

    try:
        return float(_registry().Quantity(Decimal(found[1]), found[2]).to(unit).magnitude)
    except (pint.PintError, ArithmeticError, ValueError, TypeError, AttributeError):
        raise ValueError(
            f"{name} = {shown(value)} is not in {unit or 'a number'}; accepted: {accepted}"
        ) from None


def _number_or_text(value: Any) -> Any:
    """The number of a text that is one, anything else as it is."""
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return value


@cache
def _registry() -> Any:
    """pint's units. About 0.4 s at the first use."""
    import pint

    kind: Any = Decimal
    return pint.UnitRegistry(non_int_type=kind)


def toml_text(machine: str, numbers: Mapping[str, Any], about: str) -> str:
    """Numbers and arrays of them by dotted name as TOML, `about` as comments above.

    Each number in the shortest digits of its own precision.
    """
    lines = [f"# {line}" for line in about.splitlines()]
    lines += [f'machine = "{machine}"']
    for name, value in numbers.items():
        array = np.asarray(value)
        digits = map(str, array.ravel())
        lines.append(f"{name} = [{', '.join(digits)}]" if array.ndim else f"{name} = {array[()]}")
    return "\n".join(lines) + "\n"
