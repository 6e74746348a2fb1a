"""Columns of numbers from a user's CSV file, by their names."""

from __future__ import annotations

import csv
import io
import math
import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from stickslip.dynamics.checks import nearest, require_memory, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from jaxtyping import Float

BYTES = 20
"""Of memory for each byte of a file, about, while it is read."""


def read_columns(
    path: str | Path, units: Mapping[str, str], accepted: str
) -> Float[np.ndarray, "rows columns"]:
    """The columns of a CSV file named in `units`, in that order.

    The head names the columns, with the unit in brackets or without: "time [s]"; in another unit
    they are refused, not converted. A file without a head and with as many columns as names is
    taken in their order. Blank lines and lines that begin with # are passed over. accepted: what
    such a file is, for the messages. ValueError names the file and the line of what is damaged,
    missing, no number, not finite or in another unit; OSError where it cannot be opened.
    """
    path, names = Path(path), list(units)
    rows = _rows(path, accepted)
    first, head = rows[0]
    if len(head) == len(names) and all(map(_is_number, head)):
        places = list(range(len(names)))
    else:
        places, rows = _places(path, first, head, units, accepted), rows[1:]
    if not rows:
        raise ValueError(f"{path}: no rows below the head; accepted: {accepted}")
    found = np.empty((len(rows), len(names)))
    for index, (line, cells) in enumerate(rows):
        if len(cells) != len(head):
            raise ValueError(
                f"{path}:{line}: {len(cells)} cells where the first line has {len(head)}; "
                f"accepted: {accepted}"
            )
        for column, place in enumerate(places):
            if not _is_number(cells[place]):
                raise ValueError(
                    f"{path}:{line}: {names[column]} = {shown(cells[place])} is no finite number; "
                    f"accepted: {accepted}"
                )
            found[index, column] = float(cells[place])
    return found


def _rows(path: Path, accepted: str) -> list[tuple[int, list[str]]]:
    """Lines that say something, in cells, each with its number; one at least."""
    text = _text(path, accepted)
    found = []
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for cells in lines:
            if any(map(str.strip, cells)) and not cells[0].lstrip().startswith("#"):
                found.append((lines.line_num, [cell.strip() for cell in cells]))
    except csv.Error as error:
        raise ValueError(f"{path}:{lines.line_num}: {error}; accepted: {accepted}") from None
    if not found:
        raise ValueError(f"{path} is empty; accepted: {accepted}")
    return found


def _text(path: Path, accepted: str) -> str:
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    about = os.fstat(descriptor)
    if not stat.S_ISREG(about.st_mode):
        os.close(descriptor)
        raise ValueError(f"{path} is not a regular file; accepted: {accepted}")
    with os.fdopen(descriptor, "rb") as file:
        require_memory(str(path), "bytes of text", about.st_size, BYTES)
        content = file.read()
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path} is no text in UTF-8 ({error}); accepted: {accepted}") from None


def _places(
    path: Path, line: int, head: Sequence[str], units: Mapping[str, str], accepted: str
) -> list[int]:
    parts = [title.strip("\"'").partition("[") for title in head]
    plain = [name.strip() for name, _, _ in parts]
    for name, unit in units.items():
        if plain.count(name) != 1:
            how = "no" if name not in plain else "more than one"
            raise ValueError(
                f"{path}:{line}: {how} column {name!r} among {shown(', '.join(plain))}"
                f"{nearest(name, plain) if how == 'no' else ''}; accepted: {accepted}"
            )
        _, bracket, given = parts[plain.index(name)]
        given = given.partition("]")[0].strip()
        if bracket and given != unit:
            raise ValueError(
                f"{path}:{line}: column {name!r} is in {shown(given)}; accepted: {accepted}"
            )
    return [plain.index(name) for name in units]


def _is_number(text: str) -> bool:
    """Whether it is a finite number; 1_000 is none."""
    try:
        return "_" not in text and math.isfinite(float(text))
    except ValueError:
        return False
