"""Damaged, truncated and hostile track files: a ValueError or a track; counts are printed."""

import resource
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from stickslip.dynamics.ugv import Track
from stickslip.optim.posture.track_file import read_track
from tests.fuzz.spoilt import mutated

pytestmark = pytest.mark.long

COUNT = 10_000
SLOW = 10.0
"""Processor seconds that no file may take; on a busy machine the clock says more."""
ROOM = 2**30
"""Bytes that no file may take."""

ROWS = "".join(f"{0.5 * i:.3f},{np.sin(0.3 * i):.5f}\n" for i in range(40))
NODES = "".join(
    f'<trkpt lat="{59 + 1e-4 * i:.5f}" lon="10.5"><ele>{100 + i % 7}</ele></trkpt>'
    for i in range(30)
)
HEAD = '<?xml version="1.0" encoding="UTF-8"?>'
GPX = f"{HEAD}<gpx version='1.1'><trk><name>a &amp; b</name><trkseg>{NODES}</trkseg></trk></gpx>"
GOOD = (
    ("a.csv", "x,y\n" + ROWS),
    ("b.csv", "# a comment\n" + ROWS.replace(",", ";")),
    ("c.txt", "elevation\tdistance\n" + "".join(f"{np.cos(i):.4f}\t{i}\n" for i in range(40))),
    ("d.gpx", GPX),
)
PIECES = (
    b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"nan", b"inf", b"-", b"1e999", b"1e-320", b"_", b",",
    b";", b"\t", b"\n", b"\r", b"#", b'"', b"<", b">", b"&", b"&#0;", b"&#x110000;", b"&lt;",
    b"<!--", b"-->", b"<![CDATA[", b"]]>", b"<trkpt>", b"</trkpt>", b"<ele>", b"</ele>", b"<?x?>",
    b"<!DOCTYPE a>", b"9" * 400, b"\xf0\x9f\x9a\x97", b"\xed\xa0\x80", b"\xe2\x80\xa8", b"x,y\n",
)  # fmt: skip


def damaged(random: np.random.Generator) -> tuple[str, bytes]:
    """A good file, damaged."""
    name, text = GOOD[random.integers(len(GOOD))]
    return name, mutated(text.encode(), PIECES, random)


def hostile() -> dict[str, tuple[str, bytes]]:
    """Written to cost time or memory, or to reach what is not the file's."""
    bomb = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))
    many = 10**6
    files = {
        "entity bomb": f'{HEAD}<!DOCTYPE g [<!ENTITY l0 "lol">{bomb}]><gpx>&l11;</gpx>',
        "external entity": '<!DOCTYPE g [<!ENTITY x SYSTEM "file:///dev/zero">]><g>&x;</g>',
        "entity without a type": "<gpx><trkpt lat='&lol;'/></gpx>",
        "nested elements": "<a>" * many,
        "flat points": "<gpx>" + "<trkpt/>" * many + "</gpx>",
        "one attribute": f'<gpx><trkpt lat="{"1" * 10**7}"/></gpx>',
        "a tag without end": "<" + "a" * 10**7,
        "a comment without end": "<!--" + "-" * 10**7,
        "utf-16 declared": GPX.replace("UTF-8", "UTF-16"),
        "utf-7 declared": GPX.replace("UTF-8", "UTF-7"),
        "namespaces": "<gpx " + " ".join(f'xmlns:n{i}="u"' for i in range(10**5)) + "/>",
        "elevation in pieces": "<gpx><trkpt lat='1' lon='1'><ele>" + "1<!---->" * 10**6,
    }
    tables = {
        "one line": "1," * (5 * 10**6),
        "one number": "1" * 10**7,
        "comments": "#\n" * 10**7,
        "columns": "x,y" + ",z" * 10**6 + "\n",
        "points that stand still": "0 0\n" * (5 * 10**6),
        "two points far apart": "0,0\n1e300,1\n",
        "points of no distance": "".join(f"{1 + i * 2.3e-16:.17g},0\n" for i in range(1000)),
        "other digits": "٠,٠\n١,١\n",
    }
    found = {name: ("h.gpx", text.encode()) for name, text in files.items()}
    found |= {name: ("h.csv", text.encode()) for name, text in tables.items()}
    found["utf-16"] = ("h.gpx", GPX.encode("utf-16"))
    found["too large"] = ("h.csv", b"0,0\n" * (5 * 2**20))
    return found


def outcome(path) -> str:
    """How reading ends, by the one way that is allowed or by a track; anything else fails."""
    began = time.process_time()
    try:
        track = read_track(path)
    except ValueError as error:
        told = "refused" if len(str(error)) < 1000 else "refused at too great a length"
    else:
        assert isinstance(track, Track)
        assert all(np.all(np.isfinite(v)) for v in (track.shape.knots, track.shape.coefficients))
        told = "a track"
    assert time.process_time() - began < SLOW
    return told


def test_mutations_of_good_files(tmp_path, capsys):
    random, counts = np.random.default_rng(10), Counter()
    for _ in range(COUNT):
        name, raw = damaged(random)
        path = tmp_path / name
        path.write_bytes(raw)
        counts[outcome(path)] += 1
    with capsys.disabled():
        print(f"\n{COUNT} damaged track files: {dict(counts)}")
    assert set(counts) == {"refused", "a track"}


def test_files_written_to_hurt(tmp_path, capsys):
    """In a process whose address space grows by ROOM at most, or MemoryError would end the test."""
    counts = Counter()
    files = hostile()
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    held = pages * resource.getpagesize()
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (held + ROOM, before[1]))
    try:
        for name, (file, raw) in files.items():
            path = tmp_path / file
            path.write_bytes(raw)
            told = outcome(path)
            counts[told] += 1
            assert told == "refused" or name in TRACKS, name
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    with capsys.disabled():
        print(f"\n{len(files)} hostile track files: {dict(counts)}")


TRACKS = ("utf-16 declared", "utf-7 declared", "other digits",
          "points of no distance")  # fmt: skip
"""Odd, but tracks: the encoding is UTF-8 whatever is declared, and digits are digits."""
