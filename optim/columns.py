"""Columns of numbers from a user's table, CSV and its relatives, by the names in the head."""

from __future__ import annotations

import math
import os
import re
import stat
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_memory, reraise, shown
from stickslip.dynamics.machine_file import quantity

if TYPE_CHECKING:
    from jaxtyping import Float

BYTES = 20
"""Memory for each byte of a file while it is read, about [bytes]."""
DECIMAL_COMMA = re.compile(r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$")
CELL = re.compile(r"(?:\s*[\[(].*?[\])]|\S)+")
"""A title between blanks; those within brackets belong to its unit."""
BRACKETED = re.compile(r"(.*?)\s*[\[(]([^\[(]*)[\])]")


class ColumnSpec(NamedTuple):
    """A column to look for: its name, its unit and its other names.

    The case of a name counts where it tells two columns apart (t and T).
    """

    name: str
    unit: str
    also: tuple[str, ...] = ()
    optional: bool = False
    """True: only under a head that names it, left out elsewhere."""


TIME = ColumnSpec("time", "s", ("t",))
TORQUE = ColumnSpec("torque", "N m", ("T", "tau", "M"))
"""Columns of walks that are measured or commanded."""


def accepted_table(wanted: Sequence[ColumnSpec]) -> str:
    """Accepted forms of a table with these columns, for messages and the help."""
    columns = " and ".join(
        f"{'perhaps ' * one.optional}{' or '.join((one.name, *one.also))} [{one.unit}]"
        for one in wanted
    )
    return (
        f"columns {columns}, separated by comma, semicolon, tab or blanks, under no head or one "
        f"with such names; finite numbers, {wanted[0].name} increasing"
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

    Blank lines and lines that begin with # are passed over, but a head may stand behind # above the
    numbers, as `numpy.savetxt` writes it; one in another unit, as "x [mm]", is converted.

    also: what the caller accepts besides, for messages. most: bytes of a file. unordered: what to
    say of a first column that does not increase; None accepts it.
    ValueError names the file, the line and what is accepted; OSError where it cannot be opened.
    """
    accepted = also + accepted_table(wanted)
    text = read_text(path, accepted, most)
    with reraise("", f"; accepted: {accepted}"):
        return _columns(path, text, wanted, unordered)


def _columns(
    path: Path, text: str, wanted: Sequence[ColumnSpec], unordered: str | None
) -> Float[np.ndarray, "rows columns"]:
    name = shown_path(path)
    numbered = ((number, line.strip(" ")) for number, line in enumerate(text.splitlines(), start=1))
    filled = [one for one in numbered if one[1].strip(" \t;,")]
    lines = [one for one in filled if not one[1].startswith("#")]
    if not lines:
        raise ValueError(f"{name} is empty")
    mark, head = _marked(lines[0][1])
    if is_number(head[0]) and (above := filled[: filled.index(lines[0])]):
        told = _marked(above[-1][1].lstrip("# "))[1]
        if len(told) == len(head) and any(_named(_name_and_unit(one)[0], wanted) for one in told):
            head, lines = told, [above[-1], *lines]
    number = lines[0][0]
    if any(map(is_number, head)):
        wanted = [one for one in wanted if not one.optional]
        taken, width = [(at, 1.0) for at in range(len(wanted))], len(wanted)
    else:
        called = [_named(_name_and_unit(title)[0], wanted) for title in head]
        wanted = [one for one in wanted if not one.optional or one in called]
        place, width, lines = f"{name}:{number}", len(head), lines[1:]
        taken = [_taken(place, head, called, one) for one in wanted]
    if not lines:
        raise ValueError(f"{name}: no rows below the head")
    found: list[list[float]] = []
    for number, line in lines:
        cells = _cells(line.split(mark), mark)
        if len(cells) != width:
            raise ValueError(f"{name}:{number}: {len(cells)} columns instead of {width}")
        row = [by * float(cells[at]) if is_number(cells[at]) else math.nan for at, by in taken]
        for spec, (at, _), value in zip(wanted, taken, row, strict=True):
            if not math.isfinite(value):
                what = f"{spec.name} = {shown(cells[at])} is no finite number"
                raise ValueError(f"{name}:{number}: {what}")
        if unordered is not None and found and not found[-1][0] < row[0]:
            what = f"{wanted[0].name} = {row[0]} after {found[-1][0]} does not increase"
            raise ValueError(f"{name}:{number}: {what}{unordered}")
        found.append(row)
    return np.array(found)


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
        raise ValueError(f"{name}: byte {error.start} is no UTF-8; accepted: {accepted}") from None
    if "\0" in text:
        raise ValueError(f"{name}: not a text file; accepted: {accepted}")
    return text


def shown_path(path: Path) -> str:
    """The path on one line, its end where it is long."""
    text = " ".join(str(path).split())
    return text if len(text) <= 200 else f"... {text[-200:]}"


def _marked(line: str) -> tuple[str | None, list[str]]:
    """What stands between the cells of a first line, None for blanks, and its cells."""
    mark = next((mark for mark in ";\t," if mark in line), None)
    return mark, _cells(line.split(mark) if mark else CELL.findall(line), mark)


def _cells(parts: Sequence[str], mark: str | None) -> list[str]:
    cells = [cell.strip().strip("\"'") for cell in parts]
    if mark != ",":
        cells = [DECIMAL_COMMA.sub(r"\1.\2", cell) for cell in cells]
    return cells


def _taken(
    place: str, head: Sequence[str], called: Sequence[ColumnSpec | None], spec: ColumnSpec
) -> tuple[int, float]:
    """Index of a wanted column, and the factor of its unit. called: the column of each title."""
    if called.count(spec) != 1:
        many = "more than one" if spec in called else "no"
        hint = "" if spec in called else f" (name it {spec.name} in the head)"
        among = shown(", ".join(head))
        raise ValueError(f"{place}: {many} column {spec.name!r} among {among}{hint}")
    at = called.index(spec)
    unit = _name_and_unit(head[at])[1]
    if _plain(unit) in ("", _plain(spec.unit)):
        return at, 1.0
    apart = re.sub(r"N(?=[cm]?m$)", "N ", re.sub(r"[.·⋅]|(?<!\^)-", " ", unit))
    try:
        return at, quantity("unit", f"1 {apart}", spec.unit)
    except ValueError:
        raise ValueError(f"{place}: column {shown(head[at])} is not in {spec.unit}") from None


def _plain(unit: str) -> str:
    return re.sub(r"[\s.*·⋅-]", "", unit)


def _name_and_unit(title: str) -> tuple[str, str]:
    """Name and unit of "time [s]" or "time (s)"; of a head without a unit, the empty text."""
    found = BRACKETED.fullmatch(title)
    return (found[1], found[2]) if found else (title, "")


def _named(title: str, wanted: Sequence[ColumnSpec]) -> ColumnSpec | None:
    """The column that has the title among its names; case counts where it names another one."""
    title = title.replace("_", " ")
    for same in (str, str.lower):
        for one in wanted:
            if same(title) in map(same, (one.name, *one.also)):
                return one
    return None


def is_number(text: str) -> bool:
    """True if it is a number, perhaps none that is finite; 1_000 is none."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text
