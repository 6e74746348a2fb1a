"""Save pictures as an animation: GIF, APNG (.png), WebP or MP4."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import zlib
from itertools import chain
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.extras import require
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from PIL.Image import Image

MP4 = ".mp4"
FORMATS = {".gif": "GIF", ".png": "PNG", ".webp": "WEBP"}
"""Of Pillow."""
SUFFIXES = (*FORMATS, MP4)
FASTEST_GIF = 50.0
"""Viewers slow down a GIF that asks for more pictures a second."""
COLOURS = 255
"""Of a GIF's palette."""
MISSING = (
    'an .mp4 needs ffmpeg, and there is none; accepted: pip install "stickslip[viz]", an ffmpeg on '
    "the PATH, or a .gif, .png or .webp"
)


def save_animation(frames: Iterable[np.ndarray], path: str | Path, fps: float = 25) -> Path:
    """Save pictures, uint8 [height, width, 3] all of one size, and return the path.

    The suffix chooses the format: .gif has one palette of 255 colours made from all frames, .png
    (APNG) keeps every colour, .webp is the smallest; these repeat for ever. .mp4 is H.264, written
    by ffmpeg picture by picture, odd sizes with a row or column more. One picture every
    1 / fps [s]. An existing file is replaced only when the new one is complete. Needs the extra
    `viz`.
    """
    path = Path(path)
    require_format(path)
    suffix = path.suffix.lower()
    fastest = FASTEST_GIF if suffix == ".gif" else 1000.0
    if not 0 < fps <= fastest:
        raise ValueError(f"fps = {fps}; accepted for {suffix}: 0 < fps <= {fastest:g}")
    checked = _checked(frames)
    first = next(checked, None)
    if first is None:
        raise ValueError("frames is empty; accepted: at least one picture")
    path.parent.mkdir(parents=True, exist_ok=True)
    with writing(path) as file:
        if suffix == MP4:
            _write_mp4(first, checked, file.name, fps)
        else:
            _write_images(chain([first], checked), file, suffix, fps)
    return path


def require_format(path: Path) -> None:
    """Raise ValueError for a suffix that is none of SUFFIXES, and for .mp4 without ffmpeg."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(SUFFIXES)}")
    if path.suffix.lower() != MP4:
        require("PIL.Image")
        return
    find_ffmpeg()


def find_ffmpeg() -> str:
    """The ffmpeg on the PATH, or imageio-ffmpeg's. ValueError if there is none."""
    try:
        return shutil.which("ffmpeg") or require("imageio_ffmpeg").get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise ValueError(MISSING) from error


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


def _write_mp4(first: np.ndarray, rest: Iterator[np.ndarray], name: str, fps: float) -> None:
    """Send each picture to ffmpeg as it comes. OSError with its last line where it fails."""
    height, width = first.shape[:2]
    given = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {fps!r} -i -".split()
    even = ["-an", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"]
    made = ["-crf", "18", "-movflags", "+faststart", "-f", "mp4", "-y"]
    command = [find_ffmpeg(), "-loglevel", "error", *given, *even, *made, f"file:{name}"]
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors
        )
        try:
            for frame in chain([first], rest):
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
    """Write by Pillow. Frames lie compressed in memory until palette and times are known."""
    reel, shape = [], (0, 0, 3)
    for frame in frames:
        reel.append(zlib.compress(frame.tobytes(), level=1))
        shape = frame.shape

    def frame_of(packed: bytes) -> np.ndarray:
        return np.frombuffer(zlib.decompress(packed), np.uint8).reshape(shape)

    convert = require("PIL.Image").fromarray
    if suffix == ".gif":
        convert = _Indexer(
            np.concatenate([frame_of(one)[::3] for one in reel[:: len(reel) // 8 + 1]])
        )
    ticks = 10 if suffix == ".gif" else 1  # [ms]
    edges = np.round(np.arange(len(reel) + 1) * 1000 / fps / ticks)
    more = {"quality": 50, "method": 4} if suffix == ".webp" else {}
    convert(frame_of(reel[0])).save(
        file,
        format=FORMATS[suffix],
        save_all=True,
        append_images=_Images(lambda one: convert(frame_of(one)), reel[1:]),
        duration=(ticks * np.diff(edges)).astype(int).tolist(),
        loop=0,
        **more,
    )


class _Images:
    """Images made each time they are asked for: Pillow's writer of PNG goes through them twice."""

    def __init__(self, image: Callable[[bytes], Image], reel: list[bytes]):
        self._image, self._reel = image, reel

    def __iter__(self) -> Iterator[Image]:
        return map(self._image, self._reel)


class _Indexer:
    """Makes images with one palette: for each pixel the nearest colour, without dithering.

    Pillow's own mapping to a palette keeps 6 of a colour's 8 bits. sample: [height, width, 3].
    """

    def __init__(self, sample: np.ndarray):
        pillow = require("PIL.Image")
        quantized = pillow.fromarray(sample).quantize(COLOURS, pillow.Quantize.MEDIANCUT)
        self._palette = np.array(quantized.getpalette(), np.float32).reshape(-1, 3)[:COLOURS]
        self._table = np.full(1 << 24, COLOURS, np.uint8)  # of all colours; COLOURS is unknown

    def __call__(self, frame: np.ndarray) -> Image:
        packed = frame.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
        missing = np.unique(packed[self._table[packed] == COLOURS])
        for some in np.array_split(missing, 1 + len(missing) // 4096):
            colours = np.stack([some >> 16, (some >> 8) & 255, some & 255], -1).astype(np.float32)
            # |c - p|^2 without |c|^2, which is the same for every entry
            far = np.sum(self._palette**2, axis=1) - 2 * colours @ self._palette.T
            self._table[some] = np.argmin(far, axis=1)
        image = require("PIL.Image").fromarray(self._table[packed], "P")
        image.putpalette(self._palette.astype(np.uint8).tobytes())
        return image
