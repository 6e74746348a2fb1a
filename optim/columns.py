"""Columns of numbers from a user's table, CSV and its relatives, by the names in the head."""

from __future__ import annotations

import csv
import io
import itertools
import math
import os
import re
import stat
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.checks import nearest, require_memory, shown

if TYPE_CHECKING:
    from jaxtyping import Float

MOST_IN_A_LINE = 10_000
"""Characters."""
BYTES = 20
"""Memory for each byte of a file while it is read, about [bytes]."""
UNITS: dict[str, dict[str, tuple[float, float]]] = {
    "s": {"s": (1, 1), "ms": (1, 1000), "min": (60, 1), "h": (3600, 1)},
    "m": {"m": (1, 1), "mm": (1, 1000), "cm": (1, 100), "km": (1000, 1)},
    "N m": {"Nm": (1, 1), "mNm": (1, 1000), "Nmm": (1, 1000), "Ncm": (1, 100), "kNm": (1000, 1)},
    "rad": {"rad": (1, 1), "mrad": (1, 1000), "deg": (math.pi, 180)},
    "rad/s": {"rad/s": (1, 1), "deg/s": (math.pi, 180), "rpm": (math.pi, 30)},
    "-": {"": (1, 1)},
}
"""Unit of a result -> the units that a head may name, and what to multiply and divide by."""
SPELLED = {"sec": "s", "seconds": "s", "metres": "m", "meters": "m", "degrees": "deg", "°": "deg"}
BRACKETED = re.compile(r"(.*?)\s*[\[(]([^\[(]*)[\])]")
SUFFIXED = re.compile(r"(.+)(?:_|/| in )(.+)")
DECIMAL_COMMA = re.compile(r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$")


class ColumnSpec(NamedTuple):
    """A column to look for: its name, its unit (a key of UNITS) and its other names.

    The case of a name counts where it tells two columns apart (t and T).
    """

    name: str
    unit: str
    also: tuple[str, ...] = ()
    optional: bool = False
    """True: only under a head that names it, left out elsewhere."""


def accepted_table(wanted: Sequence[ColumnSpec]) -> str:
    """Accepted forms of a table with these columns, for messages and the help."""
    columns = " and ".join(
        f"{'perhaps ' * one.optional}{' or '.join((one.name, *one.also))} [{one.unit}]"
        for one in wanted
    )
    return (
        f"columns {columns}, apart by comma, semicolon, tab or blanks, under no head or one with "
        f"such names; finite numbers, {wanted[0].name} increasing"
    )


def read_columns(
    path: Path,
    wanted: Sequence[ColumnSpec],
    *,
    also: str = "",
    most: int | None = None,
    unordered: str | None = "",
) -> Float[np.ndarray, "rows columns"]:
    """Read the wanted columns in their units and order; the first one increases.

    Blank lines and lines that begin with # are passed over; a head in another unit of UNITS is
    converted. also: what the caller accepts besides, for messages. most: bytes of a file.
    unordered: what to say of a first column that does not increase; None accepts it.
    ValueError names the file, the line and what is accepted; OSError where it cannot be opened.
    """
    accepted = also + accepted_table(wanted)
    try:
        return _columns(path, read_text(path, accepted, most), wanted, unordered)
    except _TableError as error:
        raise ValueError(f"{error}; accepted: {accepted}") from None


class _TableError(Exception):
    """Fault of a table, and its place."""


def _columns(
    path: Path, text: str, wanted: Sequence[ColumnSpec], unordered: str | None
) -> Float[np.ndarray, "rows columns"]:
    rows = _rows(path, text)
    place, head = next(rows, ("", []))
    if not place:
        raise _TableError(f"{shown_path(path)} is empty")
    headed = not any(map(is_number, head))
    names = [_name_and_unit(title.strip("\"'"), "-")[0] for title in head] if headed else []
    wanted = [
        one
        for one in wanted
        if not one.optional or any(_is_called(name, one, wanted) for name in names)
    ]
    if headed:
        taken, width = [_taken(place, head, one, wanted) for one in wanted], len(head)
    else:
        taken, width = [(at, (1, 1)) for at in range(len(wanted))], len(wanted)
        rows = itertools.chain([(place, head)], rows)
    found = [array("d") for _ in wanted]
    for place, cells in rows:
        if len(cells) != width:
            raise _TableError(f"{place}: {len(cells)} columns instead of {width}")
        for spec, (at, (times, by)), values in zip(wanted, taken, found, strict=True):
            value = float(cells[at]) * times / by if is_number(cells[at]) else math.nan
            if not math.isfinite(value):
                raise _TableError(f"{place}: {spec.name} = {shown(cells[at])} is no finite number")
            values.append(value)
        if unordered is not None and len(found[0]) > 1 and not found[0][-2] < found[0][-1]:
            last, now = found[0][-2:]
            what = f"{place}: {wanted[0].name} = {now} after {last} does not increase"
            raise _TableError(what + unordered)
    if not found[0]:
        raise _TableError(f"{shown_path(path)}: no rows below the head")
    return np.array(found).T


def read_text(path: Path, accepted: str, most: int | None = None) -> str:
    """The text of a regular file in UTF-8 of at most so many bytes; ValueError for another."""
    name = shown_path(path)
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    about = os.fstat(descriptor)
    if not stat.S_ISREG(about.st_mode):
        os.close(descriptor)
        raise ValueError(f"{name}: not a regular file; accepted: {accepted}")
    with os.fdopen(descriptor, "rb") as file:
        if most is not None and about.st_size > most:
            raise ValueError(f"{name}: larger than {most >> 20} MiB; accepted: up to that")
        require_memory(name, "bytes of text", about.st_size, BYTES)
        raw = file.read(about.st_size + 1)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{name}: byte {error.start} is no UTF-8 text; accepted: {accepted}"
        ) from None
    if "\0" in text:
        raise ValueError(f"{name}: not a text file; accepted: {accepted}")
    return text


def shown_path(path: Path) -> str:
    """The path on one line, its end where it is long."""
    text = " ".join(str(path).split())
    return text if len(text) <= 200 else f"... {text[-200:]}"


def _rows(path: Path, text: str) -> Iterator[tuple[str, list[str]]]:
    """The cells of each line that has any, and its place in the file."""
    mark, begun = None, False
    for number, line in enumerate(io.StringIO(text, newline=None), start=1):
        place = f"{shown_path(path)}:{number}"
        if len(line) > MOST_IN_A_LINE:
            raise ValueError(
                f"{place}: a line of {len(line)} characters; accepted: up to {MOST_IN_A_LINE}"
            )
        line = line.strip(" \r\n")
        if not line.strip(" \t;,") or line.startswith("#"):
            continue
        if not begun:
            mark = next((mark for mark in ";\t," if mark in line), None)
            if mark is None:  # blanks within brackets belong to a unit
                line = re.sub(r"\s*[\[(].*?[\])]", lambda one: re.sub(r"\s", "", one[0]), line)
        begun = True
        try:
            yield place, _cells(line, mark)
        except csv.Error as error:
            raise _TableError(f"{place}: {error}") from None


def _cells(line: str, mark: str | None) -> list[str]:
    if mark is None or '"' not in line:
        cells = line.split(mark)
    else:
        cells = next(csv.reader([line], strict=True, delimiter=mark, skipinitialspace=True))
    cells = [cell.strip() for cell in cells]
    if mark != "," and "," in line:
        cells = [DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
    return cells


def _taken(
    place: str, head: Sequence[str], spec: ColumnSpec, wanted: Sequence[ColumnSpec]
) -> tuple[int, tuple[float, float]]:
    """Index of a wanted column, with its factor and divisor."""
    titles = [title.strip("\"'") for title in head]
    parts = [_name_and_unit(title, spec.unit) for title in titles]
    at = [i for i, (name, _) in enumerate(parts) if _is_called(name, spec, wanted)]
    if len(at) != 1:
        many = "more than one" if at else "no"
        near = "" if at else nearest(spec.name, [name for name, _ in parts])
        among = shown(", ".join(titles))
        raise _TableError(f"{place}: {many} column {spec.name!r} among {among}{near}")
    given = re.sub(r"[\s.*·⋅-]", "", parts[at[0]][1])
    unit, known = SPELLED.get(given.lower(), given), UNITS[spec.unit]
    if unit not in known:
        raise ValueError(
            f"{place}: column {titles[at[0]]!r} is in {shown(parts[at[0]][1])}; accepted: "
            f"{', '.join(known)}"
        )
    return at[0], known[unit]


def _name_and_unit(title: str, unit: str) -> tuple[str, str]:
    """Name and unit of "time [s]" or "time (s)"; of "time_s", "t/s", "time in s" for a known unit.

    A head without a unit is in the one given.
    """
    if found := BRACKETED.fullmatch(title):
        return found[1], found[2]
    found = SUFFIXED.fullmatch(title)
    if found and SPELLED.get(found[2].lower(), found[2]) in UNITS[unit]:
        return found[1].strip(), found[2]
    return title, unit


def _is_called(title: str, spec: ColumnSpec, wanted: Sequence[ColumnSpec]) -> bool:
    """True if the title is a name of the column; case counts where it names another one."""
    title = title.replace("_", " ")
    for same in (str, str.lower):
        called = [one for one in wanted if same(title) in map(same, (one.name, *one.also))]
        if called:
            return spec in called
    return False


def is_number(text: str) -> bool:
    """True if it is a number, perhaps none that is finite; 1_000 is none."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
