"""Tracks from files: a table of x and y."""

from __future__ import annotations

from pathlib import Path

from stickslip.dynamics.checks import require_memory, shown
from stickslip.dynamics.ugv.track import Track
from stickslip.optim.columns import ColumnSpec, read_columns, shown_path

MOST_BYTES = 16 * 2**20
"""Greatest size of a file [bytes]; a point takes about 20."""
BYTES_A_POINT = 400
"""While the spline is made, about."""
COLUMNS = (
    ColumnSpec("x", "m", ("distance", "s")),
    ColumnSpec("y", "m", ("elevation", "elev", "height", "z")),
)


def read_track(path: str | Path, interpolation: str = "cubic") -> Track:
    """The track in a table (see `read_columns`); `interpolation` as in Track.from_points.

    UTF-8, a regular file of at most MOST_BYTES. ValueError names the file, the line and what is
    accepted; OSError where the file cannot be opened.
    """
    if not isinstance(path, str | Path) or "\0" in str(path):
        raise ValueError(f"path = {shown(path)}; accepted: the path of a file")
    path = Path(path)
    name = shown_path(path)
    x, y = read_columns(path, COLUMNS, most=MOST_BYTES).T
    if len(x) < 2:
        raise ValueError(f"{name}: {len(x)} points; accepted: 2 or more")
    require_memory(name, "points", len(x), BYTES_A_POINT)
    try:
        return Track.from_points(x, y, interpolation)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from error
