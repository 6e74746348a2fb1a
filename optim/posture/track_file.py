"""Tracks from files: a table of x and y, or the elevation profile of a GPX track."""

from __future__ import annotations

import io
import math
import os
import re
import stat
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.parsers import expat

import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.ugv.track import Track

EARTH_RADIUS = 6_371_008.8
"""Mean radius [m]."""

MOST_BYTES = 16 * 2**20
"""Of a file; a point takes about 20 of them in a table and 80 in a GPX track."""
MOST_IN_A_LINE = 10_000
"""Characters of a line or of an elevation."""
DEEPEST = 100
"""Elements of a GPX file inside one another."""
BYTES_A_POINT = 400
"""While the spline is made, about."""

X_NAMES = ("x", "distance", "s")
Y_NAMES = ("y", "elevation", "height", "z")
ACCEPTED = (
    "two columns of finite numbers, x (strictly increasing) and y [m], decimal points, apart by "
    f"comma, semicolon, tab or blanks, under no header or one that names {' or '.join(X_NAMES)} "
    f"and {' or '.join(Y_NAMES)}, with [m] behind it or not"
)
IN_METRES = re.compile(r"\s*(\[m\]|\(m\))")
IN_WORDS = {"lat": "latitude", "lon": "longitude", "ele": "elevation"}
STEEPEST = 2.0
"""Steeper legs of a GPX track, in m a metre, are a fault of the survey: no vehicle climbs them."""
ACCEPTED_GPX = "a GPX track of 2 or more points that advance, each with lat, lon [deg] and ele [m]"


def read_track(path: str | Path, interpolation: str = "cubic") -> Track:
    """The track in a file; `interpolation` as in Track.from_points.

    *.gpx: track points in their order; x is the great-circle distance along them on a sphere of
    the Earth's mean radius (haversine) and y the elevation; document types, and so entities, are
    refused. Anything else: a table of two columns in metres, blank lines and lines that begin with
    # passed over. Both in UTF-8, regular files of at most MOST_BYTES. ValueError names the file,
    the line and what is accepted; OSError where the file cannot be opened.
    """
    if not isinstance(path, str | Path) or "\0" in str(path):
        raise ValueError(f"path = {shown(path)}; accepted: the path of a file")
    path = Path(path)
    text = _text(path)
    line, x, y = _gpx(path, text) if path.suffix.lower() == ".gpx" else _table(path, text)
    _require_points(path, line, x, y)
    try:
        return Track.from_points(x, y, interpolation)
    except ValueError as error:
        raise ValueError(f"{_name(path)}: {error}") from error


def _text(path: Path) -> str:
    """What is in the file, or ValueError for one that is too large or no text."""
    name = _name(path)
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise ValueError(f"{name}: not a regular file; {_accepted(path)}")
    with os.fdopen(descriptor, "rb") as file:
        raw = file.read(MOST_BYTES + 1)
    if len(raw) > MOST_BYTES:
        raise ValueError(f"{name}: larger than {MOST_BYTES >> 20} MiB; accepted: up to that")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{name}: byte {error.start} is no UTF-8 text; {_accepted(path)}"
        ) from None
    if "\0" in text:
        raise ValueError(f"{name}: not a text file; {_accepted(path)}")
    return text


def _table(path: Path, text: str) -> tuple[Sequence[int], np.ndarray, np.ndarray]:
    """The line of each point, x and y."""
    name = _name(path)
    separator, columns, width = None, (0, 1), 0
    numbers, values = array("q"), (array("d"), array("d"))
    for number, line in _lines(path, text):
        if not width:
            separator = next((mark for mark in ";\t," if mark in line), None)
            cells, width = _cells(line, separator), 2
            if not any(map(_is_number, cells)):
                cells = _cells(IN_METRES.sub("", line), separator)
                columns, width = _header(path, number, line, cells), len(cells)
                continue
        cells = _cells(line, separator)
        if len(cells) != width:
            raise ValueError(
                f"{name}:{number}: {len(cells)} columns instead of {width}; {_accepted(path)}"
            )
        for column, into in zip(columns, values, strict=True):
            try:
                into.append(_number(cells[column]))
            except ValueError:
                raise ValueError(
                    f"{name}:{number}: {shown(cells[column])} is no number; {_accepted(path)}"
                ) from None
        numbers.append(number)
        if len(numbers) > 1 and not values[0][-2] < values[0][-1]:
            break  # no more is needed to refuse it
    if not width:
        raise ValueError(f"{name}: no points; {_accepted(path)}")
    return numbers, np.array(values[0]), np.array(values[1])


def _lines(path: Path, text: str) -> Iterator[tuple[int, str]]:
    """The lines that say something, with their numbers."""
    for number, line in enumerate(io.StringIO(text, newline=None), start=1):
        if len(line) > MOST_IN_A_LINE:
            raise ValueError(
                f"{_name(path)}:{number}: a line of {len(line)} characters; accepted: up to "
                f"{MOST_IN_A_LINE}"
            )
        line = line.strip()
        if line and not line.startswith("#"):
            yield number, line


def _header(path: Path, number: int, line: str, cells: list[str]) -> tuple[int, int]:
    """Which columns are x and y."""
    names = [cell.strip("\"'").lower() for cell in cells]
    found = [[i for i, name in enumerate(names) if name in known] for known in (X_NAMES, Y_NAMES)]
    if any(len(places) != 1 for places in found):
        raise ValueError(f"{_name(path)}:{number}: header {shown(line)}; {_accepted(path)}")
    return found[0][0], found[1][0]


def _gpx(path: Path, text: str) -> tuple[Sequence[int], np.ndarray, np.ndarray]:
    """The number of each track point, distance along the track and elevation."""
    name, points = _name(path), _Points()
    try:
        points.parse(text)
    except (expat.ExpatError, ValueError) as error:
        raise ValueError(f"{name}: {error}; {_accepted(path)}") from None
    values = np.empty((len(points.found), 3))
    for i, given in enumerate(points.found):
        place = f"{name}: track point {i + 1}"
        for j, (key, value) in enumerate(zip(("lat", "lon", "ele"), given, strict=True)):
            if value is None or not value.strip():
                raise ValueError(f"{place} has no {IN_WORDS[key]} ({key}); {_accepted(path)}")
            if not _is_number(value) or not math.isfinite(float(value)):
                raise ValueError(f"{place}: {key} = {shown(value)}; {_accepted(path)}")
            values[i, j] = float(value)
        for key, value, limit in (("lat", values[i, 0], 90), ("lon", values[i, 1], 360)):
            if abs(value) > limit:
                raise ValueError(f"{place}: {key} = {value}; {_accepted(path)}")
    latitude, longitude = np.radians(values[:, :2]).T
    half = np.sin(np.diff(latitude) / 2) ** 2
    half += np.cos(latitude[1:]) * np.cos(latitude[:-1]) * np.sin(np.diff(longitude) / 2) ** 2
    legs = 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(half, 1.0)))
    x = np.zeros(len(values))
    x[1:] = np.cumsum(legs)
    return range(1, len(values) + 1), x, values[:, 2]


class _Points:
    """The track points of a GPX file, taken out as expat comes past them; no tree is built."""

    def __init__(self):
        self.found: list[tuple[str | None, str | None, str | None]] = []
        self._tags: list[str] = []
        self._place: tuple[str | None, str | None] = (None, None)
        self._elevation: str | None = None
        self._reads = False

    def parse(self, text: str) -> None:
        """ExpatError for what is no XML, ValueError for what is not accepted of it."""
        parser = expat.ParserCreate("utf-8")
        parser.StartElementHandler = self._begin
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._read
        parser.StartDoctypeDeclHandler = _no_document_type
        try:
            parser.Parse(text.encode(), True)
        except expat.ExpatError as error:
            raise ValueError(f"no XML ({error})") from None

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        tag = tag.rpartition(":")[2]
        if len(self._tags) >= DEEPEST:
            raise ValueError(f"elements nested deeper than {DEEPEST}")
        inside = self._tags[-1:] == ["trkpt"]
        self._tags.append(tag)
        if tag == "trkpt":
            self._place = (attributes.get("lat"), attributes.get("lon"))
            self._elevation = None
        self._reads = inside and tag == "ele" and self._elevation is None

    def _read(self, text: str) -> None:
        if self._reads:
            self._elevation = (self._elevation or "") + text
            if len(self._elevation) > MOST_IN_A_LINE:
                raise ValueError(f"track point {len(self.found) + 1}: a long text in ele")

    def _end(self, tag: str) -> None:
        self._reads = False
        if self._tags.pop() == "trkpt":
            self.found.append((*self._place, self._elevation))


def _no_document_type(*_: object) -> None:
    raise ValueError("declares a document type or entities")


def _require_points(path: Path, line: Sequence[int], x: np.ndarray, y: np.ndarray) -> None:
    """Raise ValueError, with its place in the file, for the first point that will not do."""
    name = _name(path)
    if len(x) < 2:
        raise ValueError(f"{name}: {len(x)} points; {_accepted(path)}")
    require_memory(name, "points", len(x), BYTES_A_POINT)
    gpx = path.suffix.lower() == ".gpx"
    before = ": track point " if gpx else ":"
    for axis, values in (("x", x), ("y", y)):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            at = f"{name}{before}{line[int(bad[0])]}"
            raise ValueError(f"{at}: {axis} = {values[bad[0]]}; {_accepted(path)}")
    wrong = np.flatnonzero(np.diff(x) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        odd = f"x = {x[i]} after {x[i - 1]} does not increase"
        if gpx:
            odd = f"the place of track point {line[i - 1]} again ({len(wrong)} such in the file)"
        raise ValueError(f"{name}{before}{line[i]}: {odd}; {_accepted(path)}")
    jump = np.abs(np.diff(y))
    steep = np.flatnonzero(jump > STEEPEST * np.diff(x))
    if gpx and steep.size:
        near = slice(max(int(steep[0]) - 3, 0), int(steep[0]) + 5)
        i, j = (int(steep[0]) + k for k in (0, 1))
        usual = float(np.median(y[near]))
        i, j = (i, j) if abs(y[i] - usual) > abs(y[j] - usual) else (j, i)
        raise ValueError(
            f"{name}{before}{line[i]}: elevation {y[i]:.6g} m among {usual:.6g} m, "
            f"{y[i] - y[j]:+.6g} m in {abs(x[i] - x[j]):.3g} m; {_accepted(path)}, slopes up to "
            f"{STEEPEST:g} m a metre"
        )


def _name(path: Path) -> str:
    """The path on one line, its end where it is long."""
    text = " ".join(str(path).split())
    return text if len(text) <= 200 else f"... {text[-200:]}"


def _accepted(path: Path) -> str:
    return f"accepted: {ACCEPTED_GPX if path.suffix.lower() == '.gpx' else ACCEPTED}"


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip() for cell in line.split(separator)]


def _number(text: str) -> float:
    """ValueError for anything else, 1_000 included."""
    return float(text.replace("_", "?"))


def _is_number(text: str) -> bool:
    try:
        _number(text)
    except ValueError:
        return False
    return True
