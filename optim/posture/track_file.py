"""Tracks from files: a table of x and y, or the elevation profile of a GPX track."""

from __future__ import annotations

import math
from pathlib import Path
from xml.parsers import expat

import numpy as np

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.ugv.track import Track
from stickslip.optim.columns import (
    MOST_IN_A_LINE,
    ColumnSpec,
    is_number,
    read_columns,
    read_text,
    shown_path,
)

EARTH_RADIUS = 6_371_008.8
"""Mean radius [m]."""

MOST_BYTES = 16 * 2**20
"""Greatest size of a file [bytes]; a point takes about 20 in a table and 80 in a GPX track."""
DEEPEST = 100
"""Elements of a GPX file inside one another."""
BYTES_A_POINT = 400
"""While the spline is made, about."""

COLUMNS = (
    ColumnSpec("x", "m", ("distance", "s")),
    ColumnSpec("y", "m", ("elevation", "elev", "height", "z")),
)
LIMITS = {"lat": 90.0, "lon": 360.0, "ele": math.inf}
"""Greatest size of a track point's numbers [deg, m]."""
STEEPEST = 2.0
"""Steeper legs of a GPX track, in m a metre, are a fault of the survey: no vehicle climbs them."""
ACCEPTED_GPX = "a GPX track of 2 or more points that advance, each with lat, lon [deg] and ele [m]"


def read_track(path: str | Path, interpolation: str = "cubic") -> Track:
    """The track in a file; `interpolation` as in Track.from_points.

    *.gpx: track points in their order; x is the great-circle distance along them on a sphere of
    the Earth's mean radius (haversine) and y the elevation; document types, and so entities, are
    refused. Anything else: a table, see `read_columns`. Both in UTF-8, regular files of at most
    MOST_BYTES. ValueError names the file, the line and what is accepted; OSError where the file
    cannot be opened.
    """
    if not isinstance(path, str | Path) or "\0" in str(path):
        raise ValueError(f"path = {shown(path)}; accepted: the path of a file")
    path = Path(path)
    name = shown_path(path)
    if path.suffix.lower() != ".gpx":
        x, y = read_columns(path, COLUMNS, most=MOST_BYTES).T
    else:
        x, y = _gpx(path, read_text(path, ACCEPTED_GPX, MOST_BYTES))
    if len(x) < 2:
        raise ValueError(f"{name}: {len(x)} points; accepted: 2 or more")
    require_memory(name, "points", len(x), BYTES_A_POINT)
    try:
        return Track.from_points(x, y, interpolation)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error


def _gpx(path: Path, text: str) -> tuple[np.ndarray, np.ndarray]:
    """Distance along the track and elevation of each track point."""
    name, points = shown_path(path), _Points()
    try:
        points.parse(text)
    except (expat.ExpatError, ValueError) as error:
        raise ValueError(f"{name}: {error}; accepted: {ACCEPTED_GPX}") from None
    values = np.empty((len(points.found), 3))
    for i, given in enumerate(points.found):
        place = f"{name}: track point {i + 1}"
        for j, (key, limit) in enumerate(LIMITS.items()):
            text = given[j] or ""
            number = float(text) if is_number(text) else math.nan
            if not (math.isfinite(number) and abs(number) <= limit):
                what = f"{place}: {key} = {shown(given[j])}"
                raise ValueError(f"{what}; accepted: {ACCEPTED_GPX}")
            values[i, j] = number
    latitude, longitude = np.radians(values[:, :2]).T
    half = np.sin(np.diff(latitude) / 2) ** 2
    half += np.cos(latitude[1:]) * np.cos(latitude[:-1]) * np.sin(np.diff(longitude) / 2) ** 2
    legs = 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(half, 1.0)))
    x = np.zeros(len(values))
    x[1:] = np.cumsum(legs)
    _require_points(path, x, values[:, 2])
    return x, values[:, 2]


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


def _require_points(path: Path, x: np.ndarray, y: np.ndarray) -> None:
    """Raise ValueError for the first track point that stands still or is absurdly steep."""
    name = f"{shown_path(path)}: track point"
    for i in np.flatnonzero(np.diff(x) <= 0)[:1]:
        raise ValueError(
            f"{name} {i + 2}: the place of track point {i + 1} again; accepted: {ACCEPTED_GPX}"
        )
    for i in np.flatnonzero(np.abs(np.diff(y)) > STEEPEST * np.diff(x))[:1]:
        raise ValueError(
            f"{name} {i + 2}: elevation {y[i + 1]:.6g} m, {y[i + 1] - y[i]:+.6g} m in "
            f"{x[i + 1] - x[i]:.3g} m; accepted: {ACCEPTED_GPX}, slopes up to {STEEPEST:g} m a "
            "metre"
        )
