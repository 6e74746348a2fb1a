"""Animation files written one picture at a time.

Pillow compresses GIF's pictures and WebP's. Its own writers of GIF and PNG hold every picture until
the last and drop those that repeat the one before, so that memory grows with the film and the file
has fewer pictures than were given; here each has its place. docs/design.md has the measurement.
"""

from __future__ import annotations

import struct
import zlib
from typing import IO, TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.film.palette import COLOURS, Indexer

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

TRANSPARENT = COLOURS
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
    Image, gif = require("PIL.Image"), require("PIL.GifImagePlugin")
    for index, (change, delay) in enumerate(
        zip(_changes(frames, palette), _durations(count, fps, 100), strict=True)
    ):
        if not index:
            height, width = change.entries.shape
            file.write(b"GIF89a" + struct.pack("<HHBBB", width, height, 0xF7, 0, 0))
            file.write(palette.tobytes().ljust(768, b"\0"))
            file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\0\0\0")
        blocks = gif.getdata(
            Image.fromarray(change.entries),
            (change.left, change.top),
            duration=10 * delay,
            transparency=TRANSPARENT,
            disposal=1,
        )
        file.write(b"".join(blocks))
    file.write(b";")


def write_apng(
    file: IO[bytes], frames: Iterable[np.ndarray], palette: np.ndarray, count: int, fps: float
) -> None:
    """A PNG with animation chunks that repeats for ever; other viewers show its first picture."""
    chunk = require("PIL.PngImagePlugin").putchunk
    colours = palette.tobytes().ljust(768, b"\0")
    opaque = b"\xff" * TRANSPARENT + b"\0"
    number = 0
    for index, (change, delay) in enumerate(
        zip(_changes(frames, palette), _durations(count, fps, 1000), strict=True)
    ):
        height, width = change.entries.shape
        if not index:
            file.write(b"\x89PNG\r\n\x1a\n")
            chunk(file, b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0))
            chunk(file, b"acTL", struct.pack(">II", count, 0))
            chunk(file, b"PLTE", colours)
            chunk(file, b"tRNS", opaque)
        place = struct.pack(">IIIII", number, width, height, change.left, change.top)
        # leave the picture, blend over it
        chunk(file, b"fcTL", place + struct.pack(">HHBB", delay, 1000, 0, 1))
        number += 1
        lines = np.pad(change.entries, ((0, 0), (1, 0)))  # filter 0 before each line
        packed = zlib.compress(lines.tobytes(), level=9)
        if index:
            chunk(file, b"fdAT", struct.pack(">I", number) + packed)
            number += 1
        else:
            chunk(file, b"IDAT", packed)
    chunk(file, b"IEND", b"")


def write_webp(file: IO[bytes], frames: Iterable[np.ndarray], count: int, fps: float) -> None:
    """A lossless WebP that repeats for ever; its encoder joins pictures that are alike."""
    Image = require("PIL.Image")
    pictures = iter(frames)

    class Film(Image.Image):
        """Pillow asks an image of several pictures for one after the other."""

        n_frames = count

        def seek(self, frame: int) -> None:
            if frame == self._place + 1:
                self.show_next()

        def tell(self) -> int:
            return self._place

        def show_next(self) -> None:
            picture = Image.fromarray(next(pictures))
            self._place = getattr(self, "_place", -1) + 1
            self._mode, self._size, self.im = picture.mode, picture.size, picture.im

    film = Film()
    film.show_next()
    film.save(
        file,
        format="WEBP",
        save_all=True,
        duration=_durations(count, fps, 1000),
        loop=0,
        lossless=True,
        quality=40,
        method=2,
    )


def _changes(frames: Iterable[np.ndarray], palette: np.ndarray) -> Iterator[Change]:
    """The first picture whole, then of each the box that changed, transparent where it did not."""
    indexer, before = Indexer(palette), None
    for frame in frames:
        entries = indexer(frame)
        if before is None:
            yield Change(entries, 0, 0)
        else:
            changed = entries != before
            rows, columns = np.flatnonzero(changed.any(1)), np.flatnonzero(changed.any(0))
            top, left = (int(rows[0]), int(columns[0])) if rows.size else (0, 0)
            bottom, right = (int(rows[-1]) + 1, int(columns[-1]) + 1) if rows.size else (1, 1)
            box = np.s_[top:bottom, left:right]
            shown = np.where(changed[box], entries[box], TRANSPARENT).astype(np.uint8)
            yield Change(shown, left, top)
        before = entries


def _durations(count: int, fps: float, ticks: int) -> list[int]:
    """How long each picture stands, in 1 / ticks [s], rounded so that the whole keeps its pace."""
    return np.diff(np.round(np.arange(count + 1) * ticks / fps)).astype(int).tolist()
