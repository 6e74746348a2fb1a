"""Save pictures as an animation: GIF, APNG (.png), WebP or MP4."""

from __future__ import annotations

import tempfile
import zlib
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.extras import require
from stickslip.envs.rendering.film.containers import write_apng, write_gif, write_webp
from stickslip.envs.rendering.film.palette import PaletteCount
from stickslip.envs.rendering.film.video import MP4, find_ffmpeg, write_mp4
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

SUFFIXES = (".gif", ".png", ".webp", MP4)
FASTEST_GIF = 50.0
"""Viewers slow down a GIF that asks for more pictures a second."""
EMPTY = "frames is empty; accepted: at least one picture"


def save_animation(frames: Iterable[np.ndarray], path: str | Path, fps: float = 25) -> Path:
    """Save pictures, uint8 [height, width, 3] all of one size, and return the path.

    The suffix chooses the format: .gif and .png (APNG) share one palette of 255 colours made from
    all frames, .webp keeps every colour; these repeat for ever. .mp4 is a film of H.264, and needs
    ffmpeg: on the PATH, or imageio-ffmpeg's. One picture every 1 / fps [s]. `frames` is read once,
    one at a time; in between they lie compressed in a temporary file, or have gone to ffmpeg. An
    existing file is replaced only when the new one is complete. Needs the extra `viz`.
    """
    path = Path(path)
    require_format(path)
    suffix = path.suffix.lower()
    fastest = FASTEST_GIF if suffix == ".gif" else 1000.0
    if not 0 < fps <= fastest:
        raise ValueError(f"fps = {fps}; accepted for {suffix}: 0 < fps <= {fastest:g}")
    if suffix == MP4:
        with writing(path) as file:
            if not write_mp4(_checked(frames), file, fps):
                raise ValueError(EMPTY)
        return path
    require("PIL.Image")
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile() as spool:
        reel = _Reel(spool)
        for frame in _checked(frames):
            reel.add(frame)
        if not len(reel):
            raise ValueError(EMPTY)
        with writing(path) as file:
            _write(reel, file, suffix, fps)
    return path


def require_format(path: Path) -> None:
    """Raise ValueError for a suffix that is none of SUFFIXES, and for .mp4 without ffmpeg."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(SUFFIXES)}")
    if path.suffix.lower() == MP4:
        find_ffmpeg()


def _checked(frames: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The frames, or ValueError saying what is wrong with one."""
    shape: tuple[int, ...] = ()
    for index, given in enumerate(frames):
        frame = np.asarray(given)
        if frame.dtype != np.uint8 or frame.ndim != 3 or frame.shape[2] != 3 or not frame.size:
            raise ValueError(
                f"frame {index} is {frame.dtype} {frame.shape}; accepted: uint8 [height, width, 3]"
            )
        if index and frame.shape != shape:
            raise ValueError(
                f"frame {index} has shape {frame.shape}; accepted: the first frame's {shape}"
            )
        shape = frame.shape
        yield frame


def _write(reel: _Reel, file: IO[bytes], suffix: str, fps: float) -> None:
    if suffix == ".webp":
        write_webp(file, reel, len(reel), fps)
        return
    writer = write_gif if suffix == ".gif" else write_apng
    writer(file, reel, reel.count.palette(), len(reel), fps)


class _Reel:
    """Frames of one size, compressed in a temporary file, and how often each colour occurs."""

    def __init__(self, spool: IO[bytes]):
        self._spool = spool
        self._sizes: list[int] = []
        self._shape: tuple[int, ...] = ()
        self.count = PaletteCount()

    def __len__(self) -> int:
        return len(self._sizes)

    def add(self, frame: np.ndarray) -> None:
        """Put a frame at the end."""
        self._shape = frame.shape
        self.count.add(frame)
        packed = zlib.compress(frame.tobytes(), level=1)
        self._spool.write(packed)
        self._sizes.append(len(packed))

    def __iter__(self) -> Iterator[np.ndarray]:
        self._spool.seek(0)
        for size in self._sizes:
            raw = zlib.decompress(self._spool.read(size))
            yield np.frombuffer(raw, np.uint8).reshape(self._shape)
