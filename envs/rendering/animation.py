"""Save pictures as an animation: GIF, APNG (.png), WebP or MP4."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from typing import IO

import numpy as np

from stickslip.dynamics.lazily import require
from stickslip.records.files import require_suffix, writing

MP4 = ".mp4"
FORMATS = {".gif": "GIF", ".png": "PNG", ".webp": "WEBP"}
"""Pillow's name of each format."""
SUFFIXES = (*FORMATS, MP4)
FASTEST_GIF = 50.0
"""Viewers slow down a GIF that asks for more pictures a second."""
COLOURS = 256
"""Colours of a picture of a GIF."""
MOST_PICTURES = 10**6
"""Pictures of an animation that Pillow writes."""
MISSING = (
    'an .mp4 needs ffmpeg, and there is none; accepted: pip install "stickslip[viz]", an ffmpeg on '
    "the PATH, or a .gif, .png or .webp"
)


def save_animation(frames: Iterable[np.ndarray], path: str | Path, fps: float = 25) -> Path:
    """Save pictures, one or more, uint8 [height, width, 3] of one size, and return the path.

    The suffix chooses the format: .gif has 256 colours a picture, .png (APNG) keeps every colour,
    .webp is the smallest; these repeat for ever. .mp4 is H.264, written by ffmpeg picture by
    picture, odd sizes with a row or column more. One picture every 1 / fps [s]. An existing file is
    replaced only when the new one is complete. Needs the extra `viz`.
    """
    path = Path(path)
    require_format(path)
    suffix = path.suffix.lower()
    fastest = FASTEST_GIF if suffix == ".gif" else 1000.0
    if not 0 < fps <= fastest:
        raise ValueError(f"fps = {fps}; accepted for {suffix}: 0 < fps <= {fastest:g}")
    path.parent.mkdir(parents=True, exist_ok=True)
    frames = _checked(frames)
    with writing(path) as file:
        if suffix == MP4:
            _write_mp4(frames, file.name, fps)
        else:
            _write_images(frames, file, suffix, fps)
    return path


def _checked(frames: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """The pictures as they come. ValueError for one of another type or size."""
    size: tuple[int, ...] = ()
    for i, frame in enumerate(frames):
        size = size or frame.shape
        if frame.dtype != np.uint8 or frame.shape != size or size[2:] != (3,):
            kind = f"picture {i} is {frame.dtype} {frame.shape}"
            raise ValueError(f"{kind}; accepted: uint8 [height, width, 3], all of one size")
        yield frame


def require_format(path: Path) -> None:
    """Raise ValueError for a suffix that is none of SUFFIXES, and for .mp4 without ffmpeg."""
    require_suffix(path, SUFFIXES)
    if path.suffix.lower() == MP4:
        find_ffmpeg()
    else:
        require("PIL.Image")


def find_ffmpeg() -> str:
    """The ffmpeg on the PATH, or imageio-ffmpeg's. ValueError if there is none."""
    try:
        return shutil.which("ffmpeg") or require("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise ValueError(MISSING) from error


def _write_mp4(frames: Iterator[np.ndarray], name: str, fps: float) -> None:
    """Send each picture to ffmpeg as it comes. OSError with its last line where it fails."""
    first = next(frames)
    height, width = first.shape[:2]
    given = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {fps!r} -i -".split()
    even = ["-an", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
    made = ["-crf", "18", "-movflags", "+faststart", "-f", "mp4", "-y"]
    command = [find_ffmpeg(), "-loglevel", "error", *given, *even, *made, f"file:{name}"]
    with tempfile.TemporaryFile() as errors:
        process = Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=errors)
        try:
            for frame in chain([first], frames):
                process.stdin.write(frame.tobytes())  # type: ignore[union-attr]
        except BrokenPipeError:
            pass  # ffmpeg has ended: its status says why
        except BaseException:
            process.kill()
            raise
        finally:
            process.communicate()
        if process.returncode:
            errors.seek(0)
            lines = errors.read()[-2000:].decode(errors="replace").strip().splitlines()
            raise OSError(f"ffmpeg failed: {lines[-1] if lines else process.returncode}")


def _write_images(frames: Iterator[np.ndarray], file: IO[bytes], suffix: str, fps: float) -> None:
    """Write by Pillow, a GIF picture by picture."""
    pillow = require("PIL.Image")
    images = (pillow.fromarray(frame) for frame in frames)
    tick = 1  # [ms]
    more = {"quality": 50, "method": 4} if suffix == ".webp" else {}
    if suffix == ".gif":
        tick, none = 10, pillow.Dither.NONE
        images = (one.quantize(COLOURS, pillow.Quantize.MEDIANCUT, dither=none) for one in images)
    edges = np.round(np.arange(MOST_PICTURES + 1) * 1000 / fps / tick)
    next(images).save(
        file,
        format=FORMATS[suffix],
        save_all=True,
        append_images=images if suffix == ".gif" else list(images),
        duration=(tick * np.diff(edges)).astype(int).tolist(),
        loop=0,
        **more,
    )
