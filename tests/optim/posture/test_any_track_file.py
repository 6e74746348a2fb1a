"""Any points, however they are written, are the knots of the track that is read."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from stickslip.optim.posture.track_file import read_track

SEPARATORS = (",", ";", "\t", " ", ", ", "  ")
steps = st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=30)
metres = st.floats(-1e3, 1e3)


@st.composite
def tables(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, str]:
    """x and y [m], and a table of them."""
    x = draw(metres) + np.cumsum([0.0, *draw(steps)])
    y = np.array(draw(st.lists(metres, min_size=len(x), max_size=len(x))))
    separator, end = draw(st.sampled_from(SEPARATORS)), draw(st.sampled_from(["\n", "\r\n"]))
    number = draw(st.sampled_from([repr, "{:.17g}".format, "{:+.16e}".format]))
    lines = [separator.join(map(number, map(float, pair))) for pair in zip(x, y, strict=True)]
    if draw(st.booleans()):
        lines.insert(0, separator.join("xy"))
    for place in draw(st.lists(st.integers(0, len(lines)), max_size=2)):
        lines.insert(place, draw(st.sampled_from(["", "# a stone", "#"])))
    return x, y, end.join(lines) + draw(st.sampled_from(["", end]))


@given(written=tables())
def test_the_points_that_are_read_are_those_that_were_written(written):
    x, y, text = written
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "track.csv"
        path.write_bytes(text.encode())
        track = read_track(path, "linear")
    np.testing.assert_array_equal(track.shape.knots + track.shape.rests, x)
    heights = track.shape.coefficients[:, 0] + track.shape.lows
    np.testing.assert_array_equal(heights[: len(x) - 1], y[:-1])
    assert (float(track.start), float(track.end)) == (x[0], x[-1])
