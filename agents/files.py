"""Writing files so that nothing written is ever lost."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path


def write_whole(path: str | Path, content: bytes | str, *, overwrite: bool = True) -> Path:
    """Write a file under a temporary name beside it, then rename: whole or not at all.

    Text is written as UTF-8. overwrite=False: ValueError if the path exists, without a gap between
    looking and writing.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    raw = content.encode() if isinstance(content, str) else content
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(raw)
            file.flush()
            os.fsync(file.fileno())
        os.chmod(name, 0o644)
        _put(name, path, overwrite)
    except FileExistsError:
        raise ValueError(
            f"{path} exists; accepted: a new path, or overwrite=True to replace it"
        ) from None
    finally:
        with suppress(FileNotFoundError):
            os.unlink(name)
    return path


def _put(name: str, path: Path, overwrite: bool) -> None:
    if overwrite:
        os.replace(name, path)
        return
    try:
        os.link(name, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without links
        if path.exists():
            raise FileExistsError(path) from None
        os.replace(name, path)
