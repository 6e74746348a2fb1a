"""Writing files so that nothing written is ever lost."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Container

PARTIAL = ".part"
REMAINS = re.compile(r"\.(.+)-[^-]{1,16}\.part", re.DOTALL)


def write_whole(path: str | Path, content: bytes | str, *, overwrite: bool = True) -> Path:
    """Write a file under a temporary name beside it, then rename: whole or not at all.

    Text is written as UTF-8. overwrite=False: ValueError if the path exists, without a gap between
    looking and writing.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    raw = content.encode() if isinstance(content, str) else content
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}-", suffix=PARTIAL)
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


def is_remains(name: str, of: Container[str]) -> bool:
    """Whether a file's name is one that `write_whole` leaves where it is killed, of these files."""
    found = REMAINS.fullmatch(name)
    return found is not None and found.group(1) in of


def put_aside(folder: Path) -> Path:
    """Rename a folder, so that it is gone at once, to be deleted; return where it is."""
    aside = folder.with_name(folder.name + PARTIAL)
    if aside.exists():
        discard(aside)
    os.replace(folder, aside)
    return aside


def discard(folder: Path) -> None:
    """Delete a folder of a run with all that is in it; a link is not followed."""
    shutil.rmtree(folder)


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
