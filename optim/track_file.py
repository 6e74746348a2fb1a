"""Tracks from files: a table of x and y, or the elevation profile of a GPX track."""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from stickslip.dynamics.ugv.track import Track

EARTH_RADIUS = 6_371_008.8
"""Mean radius [m]."""

X_NAMES = ("x", "distance", "s")
Y_NAMES = ("y", "elevation", "height", "z")
ACCEPTED = (
    "two columns of finite numbers, x (strictly increasing) and y [m], decimal points, apart by "
    f"comma, semicolon, tab or blanks, under no header or one that names {' or '.join(X_NAMES)} "
    f"and {' or '.join(Y_NAMES)}"
)
ACCEPTED_GPX = "a GPX track of 2 or more points that advance, each with lat, lon [deg] and ele [m]"


def read_track(path: str | Path, interpolation: str = "cubic") -> Track:
    """The track in a file; `interpolation` as in Track.from_points.

    *.gpx: track points in their order; x is the great-circle distance along them on a sphere of
    the Earth's mean radius (haversine) and y the elevation. Anything else: a table of two columns
    in metres, in UTF-8; blank lines and lines that begin with # are passed over. ValueError names
    the file, the line and what is accepted; OSError where the file cannot be opened.
    """
    path = Path(path)
    raw = path.read_bytes()
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"{path}: byte {error.start} is no UTF-8 text; {_accepted(path)}"
        ) from None
    if "\0" in text:
        raise ValueError(f"{path}: not a text file; {_accepted(path)}")
    places, x, y = _gpx(path, text) if path.suffix.lower() == ".gpx" else _table(path, text)
    _require_points(path, places, x, y)
    try:
        return Track.from_points(x, y, interpolation)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error


def _table(path: Path, text: str) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Where each point is found, x and y."""
    rows = [
        (number, line.strip())
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not rows:
        raise ValueError(f"{path}: no points; {_accepted(path)}")
    separator = next((mark for mark in ";\t," if mark in rows[0][1]), None)
    columns, width = (0, 1), 2
    cells = _cells(rows[0][1], separator)
    if not any(map(_is_number, cells)):
        names, width = [cell.strip("\"'").lower() for cell in cells], len(cells)
        found = [
            [i for i, name in enumerate(names) if name in known] for known in (X_NAMES, Y_NAMES)
        ]
        if any(len(places) != 1 for places in found):
            raise ValueError(f"{path}:{rows[0][0]}: header {rows[0][1]!r}; {_accepted(path)}")
        columns = (found[0][0], found[1][0])
        rows = rows[1:]
    points = np.empty((len(rows), 2))
    for i, (number, line) in enumerate(rows):
        cells = _cells(line, separator)
        if len(cells) != width:
            raise ValueError(
                f"{path}:{number}: {len(cells)} columns instead of {width}; {_accepted(path)}"
            )
        for j, column in enumerate(columns):
            try:
                points[i, j] = _number(cells[column])
            except ValueError:
                raise ValueError(
                    f"{path}:{number}: {cells[column]!r} is no number; {_accepted(path)}"
                ) from None
    return [f"{path}:{number}" for number, _ in rows], points[:, 0], points[:, 1]


def _gpx(path: Path, text: str) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Where each point is found, distance along the track and elevation."""
    if re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
        raise ValueError(f"{path}: declares a document type or entities; {_accepted(path)}")
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:
        raise ValueError(f"{path}: no XML ({error}); {_accepted(path)}") from None
    points = [node for node in root.iter() if _tag(node) == "trkpt"]
    places = [f"{path}: track point {i}" for i in range(1, len(points) + 1)]
    values = np.empty((len(points), 3))
    for i, point in enumerate(points):
        elevation = next((node.text for node in point if _tag(node) == "ele"), None)
        given = (point.get("lat"), point.get("lon"), elevation)
        for j, (name, value) in enumerate(zip(("lat", "lon", "ele"), given, strict=True)):
            if value is None or not _is_number(value) or not math.isfinite(float(value)):
                raise ValueError(f"{places[i]}: {name} = {value!r}; {_accepted(path)}")
            values[i, j] = float(value)
        for name, value, limit in (("lat", values[i, 0], 90), ("lon", values[i, 1], 360)):
            if abs(value) > limit:
                raise ValueError(f"{places[i]}: {name} = {value}; {_accepted(path)}")
    latitude, longitude = np.radians(values[:, :2]).T
    half = np.sin(np.diff(latitude) / 2) ** 2
    half += np.cos(latitude[1:]) * np.cos(latitude[:-1]) * np.sin(np.diff(longitude) / 2) ** 2
    legs = 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(half, 1.0)))
    x = np.zeros(len(points))
    x[1:] = np.cumsum(legs)
    return places, x, values[:, 2]


def _require_points(path: Path, places: list[str], x: np.ndarray, y: np.ndarray) -> None:
    """Raise ValueError, with its place in the file, for the first point that will not do."""
    if len(x) < 2:
        raise ValueError(f"{path}: {len(x)} points; {_accepted(path)}")
    for name, values in (("x", x), ("y", y)):
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise ValueError(f"{places[bad[0]]}: {name} = {values[bad[0]]}; {_accepted(path)}")
    wrong = np.flatnonzero(np.diff(x) <= 0)
    if wrong.size:
        i = int(wrong[0]) + 1
        raise ValueError(
            f"{places[i]}: x = {x[i]} after {x[i - 1]} does not increase; {_accepted(path)}"
        )


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


def _tag(node: ElementTree.Element) -> str:
    """The name without its namespace."""
    return node.tag.rpartition("}")[2] if isinstance(node.tag, str) else ""
