"""MP4, written by ffmpeg: the one on the PATH, or the one that imageio-ffmpeg brings."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    import numpy as np

MP4 = ".mp4"
MISSING = (
    'an .mp4 needs ffmpeg, and there is none; accepted: pip install "stickslip[viz]", an ffmpeg on '
    "the PATH, or a .gif, .png or .webp"
)
QUALITY = "18"
"""Of x264: 0 keeps everything, 23 is its default; lines stay clean."""


def find_ffmpeg() -> str:
    """The program to run. ValueError if there is none."""
    if found := shutil.which("ffmpeg"):
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:
        raise ValueError(MISSING) from error


def write_mp4(frames: Iterable[np.ndarray], file: IO[bytes], fps: float) -> int:
    """Write pictures [height, width, 3], uint8, of one size, and return how many there were.

    file: an open one with a name, which ffmpeg writes to. Each picture goes to ffmpeg as it comes.
    Widths and heights that are odd get a row or column more, as the format asks for even ones.
    OSError with ffmpeg's last line where it fails.
    """
    program = find_ffmpeg()
    count, process = 0, None
    with tempfile.TemporaryFile() as said:
        try:
            for frame in frames:
                if process is None:
                    height, width = frame.shape[:2]
                    command = [program, *_arguments(width, height, fps, file.name)]
                    process = subprocess.Popen(
                        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
                    )
                process.stdin.write(frame.tobytes())  # type: ignore[union-attr]
                count += 1
        except BrokenPipeError:
            pass  # ffmpeg has ended: its status says why
        except BaseException:
            if process is not None:
                process.kill()
                process.communicate()
            raise
        if process is not None:
            process.communicate()
            if process.returncode:
                said.seek(0)
                lines = said.read()[-2000:].decode(errors="replace").strip().splitlines()
                raise OSError(f"ffmpeg failed: {lines[-1] if lines else process.returncode}")
    return count


def _arguments(width: int, height: int, fps: float, name: str) -> list[str]:
    given = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {fps!r} -i -"
    even = "pad=ceil(iw/2)*2:ceil(ih/2)*2"
    made = f"-an -vf {even} -pix_fmt yuv420p -crf {QUALITY} -movflags +faststart -f mp4 -y"
    return ["-loglevel", "error", *given.split(), *made.split(), f"file:{name}"]
