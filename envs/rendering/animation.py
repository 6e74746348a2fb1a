"""Save pictures as an animation: GIF, APNG (.png), WebP or MP4."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import IO, TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering.extras import require
from stickslip.records.files import writing

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

MP4 = ".mp4"
FORMATS = {".gif": "GIF", ".png": "PNG", ".webp": "WEBP"}
"""Of Pillow."""
SUFFIXES = (*FORMATS, MP4)
FASTEST_GIF = 50.0
"""Viewers slow down a GIF that asks for more pictures a second."""
EXACT, COLOURS = 96, 255
"""Of a GIF's palette: the most frequent colours, kept as they are, and all."""
MISSING = (
    'an .mp4 needs ffmpeg, and there is none; accepted: pip install "stickslip[viz]", an ffmpeg on '
    "the PATH, or a .gif, .png or .webp"
)


def save_animation(frames: Iterable[np.ndarray], path: str | Path, fps: float = 25) -> Path:
    """Save pictures, uint8 [height, width, 3] all of one size, and return the path.

    The suffix chooses the format: .gif has one palette of 255 colours made from all frames, .png
    (APNG) and .webp keep every colour; these repeat for ever. .mp4 is H.264, written by
    imageio-ffmpeg picture by picture, odd sizes with a row or column more. One picture every
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
            _write_images(first, checked, file, suffix, fps)
    return path


def require_format(path: Path) -> None:
    """Raise ValueError for a suffix that is none of SUFFIXES, and for .mp4 without ffmpeg."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(SUFFIXES)}")
    if path.suffix.lower() != MP4:
        require("PIL.Image")
        return
    try:
        require("imageio_ffmpeg").get_ffmpeg_exe()
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
    height, width = (size + size % 2 for size in first.shape[:2])
    writer = require("imageio_ffmpeg").write_frames(
        name,
        (width, height),
        fps=fps,
        codec="libx264",
        quality=None,
        macro_block_size=1,
        ffmpeg_log_level="error",
        output_params=["-crf", "18", "-movflags", "+faststart", "-f", "mp4"],
    )
    writer.send(None)
    try:
        for frame in _chained(first, rest):
            pad = [(0, height - frame.shape[0]), (0, width - frame.shape[1]), (0, 0)]
            writer.send(np.ascontiguousarray(np.pad(frame, pad, mode="edge")))
    finally:
        writer.close()


def _write_images(
    first: np.ndarray, rest: Iterator[np.ndarray], file: IO[bytes], suffix: str, fps: float
) -> None:
    """Write by Pillow. Frames lie compressed in memory until their number and colours are known."""
    Image = require("PIL.Image")
    reel: list[bytes] = []
    counts: dict[int, int] = {}
    for frame in _chained(first, rest):
        if suffix == ".gif":
            colours, times = np.unique(_packed(frame[::3]), return_counts=True)
            for colour, count in zip(colours.tolist(), times.tolist(), strict=True):
                counts[colour] = counts.get(colour, 0) + count
        reel.append(zlib.compress(frame.tobytes(), level=1))
    palette = _palette(counts) if suffix == ".gif" else None

    def image(packed: bytes):
        found = Image.frombytes("RGB", first.shape[1::-1], zlib.decompress(packed))
        return found if palette is None else found.quantize(palette=palette, dither=0)

    ticks = 10 if suffix == ".gif" else 1  # [ms]
    edges = np.round(np.arange(len(reel) + 1) * 1000 / fps / ticks)
    images = map(image, reel)
    more = {"lossless": True, "quality": 40, "method": 2} if suffix == ".webp" else {}
    next(images).save(
        file,
        format=FORMATS[suffix],
        save_all=True,
        append_images=images,
        duration=(ticks * np.diff(edges)).astype(int).tolist(),
        loop=0,
        **more,
    )


def _palette(counts: dict[int, int]):
    """The commonest colours as they are, the rest by median cut, each colour counted once so that
    thin lines keep theirs."""
    Image = require("PIL.Image")
    order = np.array(sorted(counts, key=lambda colour: -counts[colour]), np.uint32)
    colours = np.stack([order >> 16, (order >> 8) & 255, order & 255], -1).astype(np.uint8)
    entries = colours[:COLOURS]
    if len(colours) > COLOURS:
        rest = Image.fromarray(colours[None, EXACT:])
        cut = rest.quantize(COLOURS - EXACT, method=Image.Quantize.MEDIANCUT).getpalette()
        entries = np.concatenate([colours[:EXACT], np.array(cut, np.uint8).reshape(-1, 3)])
    made = Image.new("P", (1, 1))
    made.putpalette(entries[:COLOURS].tobytes())
    return made


def _packed(frame: np.ndarray) -> np.ndarray:
    red, green, blue = np.moveaxis(frame.astype(np.uint32), -1, 0)
    return (red << 16) | (green << 8) | blue


def _chained(first: np.ndarray, rest: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    yield first
    yield from rest
