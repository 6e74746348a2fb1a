"""Animation files written one picture at a time; Pillow compresses each picture.

Pillow's own animation writers hold every picture until the last and drop those that repeat the one
before, so that a file has fewer pictures than were given; here each has its place.
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from typing import IO, TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.palette import Indexer

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

TRANSPARENT = 255
"""The palette entry that lets the picture before show through."""


class Change(NamedTuple):
    """What differs from the picture before: palette entries [h, w] and where they go."""

    entries: np.ndarray
    left: int
    top: int


def write_gif(
    file: IO[bytes], frames: Iterable[np.ndarray], palette: np.ndarray, count: int, fps: float
) -> None:
    """A GIF (version 89a) that repeats for ever."""
    plugin = require("PIL.GifImagePlugin")
    Image = require("PIL.Image")
    delays = np.diff(np.round(np.arange(count + 1) * 100 / fps)).astype(int).tolist()
    started = False
    for change, delay in zip(_changes(frames, palette), delays, strict=True):
        height, width = change.entries.shape
        if not started:
            file.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0))
            file.write(palette.tobytes().ljust(768, b"\0"))
            file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")
            started = True
        # disposal 1 (leave the picture), with a transparent entry
        file.write(b"\x21\xf9\x04" + struct.pack("<BHBB", 1 << 2 | 1, delay, TRANSPARENT, 0))
        picture = Image.fromarray(change.entries)
        place = struct.pack("<HHHH", change.left, change.top, width, height)
        file.write(b"," + place + b"\0" + _lzw(picture, plugin))
    file.write(b";")
