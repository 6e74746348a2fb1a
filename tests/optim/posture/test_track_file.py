"""Tracks come out of files as they were written, and what is no track is refused with its place."""

import os
import re
import tempfile
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stickslip.optim.posture.track_file import EARTH_RADIUS, read_track

TABLES = {
    "comma": "0,0.0\n1,0.5\n3,0.25\n",
    "units": "x [m]  y [m]\n0 0.0\n1 0.5\n3 0.25\n",
    "named columns": "Elevation;grade;Distance\n0.0;a;0\n0.5;b;1\n0.25;c;3\n",
    "decimal commas": "x [mm];z (ft)\n0;0,0\n1000;1,6404199475065616\n3e3;0,8202099737532808\n",
    "quoted header": '"s","height"\r\n0,0.0\r\n1,0.5\r\n3,0.25\r\n',
    "byte order mark": "\ufeffx,y\n0,0.0\n1,0.5\n3,0.25\n",
}


def write(folder, text, name="track.csv"):
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def gpx(*points, prologue="", ns=' xmlns="http://www.topografix.com/GPX/1/1"'):
    node = '<trkpt lat="{}" lon="{}"><time>x</time><ele>{}</ele></trkpt>'
    nodes = "".join(node.format(*point) for point in points)
    first = f'<?xml version="1.0" encoding="UTF-8"?>{prologue}'
    return f"{first}<gpx{ns}><trk><trkseg>{nodes}</trkseg></trk></gpx>"


@pytest.mark.parametrize("kind", TABLES)
def test_every_way_of_writing_a_table_gives_the_same_track(kind, tmp_path, float64):
    track = read_track(write(tmp_path, TABLES[kind]), "linear")
    assert (track.start, track.end) == (0.0, 3.0)
    found = track.height(jnp.asarray([0.0, 0.5, 1.0, 2.0, 3.0]))
    np.testing.assert_allclose(found, [0.0, 0.25, 0.5, 0.375, 0.25], rtol=1e-14)


@pytest.mark.parametrize("ns", ["", ' xmlns="http://www.topografix.com/GPX/1/1"'])
def test_an_elevation_profile_is_laid_out_along_great_circles(ns, tmp_path, float64):
    """A degree along a meridian, one along the parallel of 60 degrees by the law of cosines."""
    degree = np.radians(1.0)
    points = [(59, 10, 100), (60, 10, 160), (60, 11, 130.5)]
    track = read_track(write(tmp_path, gpx(*points, ns=ns), "Ride.GPX"), "linear")
    east = np.arccos(0.75 + 0.25 * np.cos(degree))
    x = EARTH_RADIUS * np.asarray([0.0, degree, degree + east])
    np.testing.assert_allclose(track.end, x[-1], rtol=1e-12)
    np.testing.assert_allclose(track.height(jnp.asarray(x)), [100, 160, 130.5], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ("track.csv is empty", "columns x or distance")),
        (b"\x89PNG\r\n\x1a\n\xff\xfe", ("track.csv: byte 0 is no UTF-8", "columns x")),
        ("x,y\n0,0\n\n1\n", ("track.csv:4: 1 columns instead of 2",)),
        ("0,0\n1,nan\n2,0\n", ("track.csv:2: y = 'nan' is no finite number",)),
        ("x,y\n0,0\n# a stone\n2,1\n2,1\n", ("track.csv:5: x = 2.0 after 2.0 does not increase",)),
        ("x [kgf.s],y [m]\n0,0\n1,1\n", ("track.csv:1: column 'x [kgf.s]' is not in m",)),
        ("lat,lon\n0,0\n1,1\n", ("no column 'x' among 'lat, lon' (name it x", "elevation")),
        ("x,s,y\n0,0,0\n1,1,1\n", ("track.csv:1: more than one column 'x' among 'x, s, y'",)),
        ("0,0\n1e-310,1\n", ("track.csv: ", "overflows float64")),
        ("0,0\n" + "1" * 20_000 + "\n", ("track.csv:2: 1 columns instead of 2",)),
    ],
)  # fmt: skip
def test_a_table_that_is_no_track_is_refused_with_its_line(text, parts, tmp_path):
    with pytest.raises(ValueError, match=".*".join(map(re.escape, parts))):
        read_track(write(tmp_path, text))


def survey(odd):
    """Ten points 5.56 m apart near 1800 m, some of another elevation."""
    return [(45 + 5e-5 * i, 7, odd.get(i, 1800 + 0.1 * i)) for i in range(10)]


GOOD = [(59, 10, 100), (60, 10, 160)]


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("", ("track.gpx: no XML", "GPX track")),
        (gpx(GOOD[0], GOOD[0]), ("track.gpx: track point 2: the place of track point 1 again",)),
        (gpx(GOOD[0], (60, 10, "")), ("track.gpx: track point 2: ele = None",)),
        (gpx(*survey({7: 46.8})), ("track point 8: elevation 46.8 m, -1753.8 m in 5.56 m",)),
        (gpx(GOOD[0], (95, 10, 0)), ("track.gpx: track point 2: lat = '95'",)),
        (gpx(*GOOD, prologue='<!DOCTYPE g [<!ENTITY a "b">]>'), ("declares a document type",)),
        (gpx(*GOOD).replace("100", "&lol;"), ("track.gpx: no XML (undefined entity",)),
        ("<a>" * 10**6, ("track.gpx: elements nested deeper than 100",)),
        (gpx((60, 10, "7" * 20_000)), ("track point 1: a long text in ele",)),
    ],
)
def test_an_elevation_profile_that_is_no_track_is_refused(text, parts, tmp_path):
    with pytest.raises(ValueError, match=".*".join(map(re.escape, parts))):
        read_track(write(tmp_path, text, "track.gpx"))


def test_files_that_cannot_be_opened_are_os_errors_that_name_them(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none\.csv"):
        read_track(tmp_path / "none.csv")
    with pytest.raises(ValueError, match="interpolation = 'wavy'"):
        read_track(write(tmp_path, TABLES["comma"]), "wavy")


def test_what_is_no_regular_file_is_refused_at_once(tmp_path, monkeypatch):
    """A folder, a pipe that nobody writes into, a device without end, a path that is none."""
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    for path in (tmp_path, pipe, "/dev/zero"):
        with pytest.raises(ValueError, match="not a regular file"):
            read_track(path)
    for path in (3, None, "a\0b", b"track.csv"):
        with pytest.raises(ValueError, match="accepted: the path of a file"):
            read_track(path)
    monkeypatch.setattr("stickslip.optim.posture.track_file.MOST_BYTES", 10)
    with pytest.raises(ValueError, match=r"track\.csv: larger than"):
        read_track(write(tmp_path, TABLES["comma"]))


def test_text_in_sections_comments_and_other_elements_is_passed_over(tmp_path, float64):
    """CDATA is text, an element inside ele ends it, and only the first ele counts."""
    nodes = "".join(
        f'<trkpt lat="{lat}" lon="10"><!-- 9 --><ele><![CDATA[{ele}]]></ele><ele>7</ele></trkpt>'
        for lat, ele in ((59, 100), (60, 160))
    )
    track = read_track(write(tmp_path, f"<gpx><wpt><ele>5</ele></wpt>{nodes}</gpx>", "a.gpx"))
    assert float(track.height(track.end)) == pytest.approx(160.0, rel=1e-12)


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
