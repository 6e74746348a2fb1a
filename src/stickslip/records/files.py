"""Writing files so that nothing written is ever lost."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Container, Iterator

PARTIAL = ".part"
LONGEST_NAME = 255
"""Bytes of a file's name that file systems take."""
REMAINS = re.compile(r"\.(.+)-[^-]{1,16}\.part", re.DOTALL)


def write_whole(path: str | Path, content: bytes | str, *, overwrite: bool = True) -> Path:
    """Write a file whole or not at all, see `writing`. Text is written as UTF-8."""
    with writing(path, overwrite=overwrite) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return Path(path)


@contextmanager
def writing(path: str | Path, *, overwrite: bool = True) -> Iterator[IO[bytes]]:
    """A file to write to, under a temporary name beside `path`, renamed once all of it is there.

    Where the body raises, nothing is left of it; an error of the system's that names no file or the
    temporary one names `path`. overwrite=False: ValueError if the path exists, without a gap
    between looking and writing.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    token = secrets.token_hex(4)
    name = path.with_name(f".{path.name}-{token}{PARTIAL}")
    if len(os.fsencode(name.name)) > LONGEST_NAME:
        name = path.with_name(f".{token}{PARTIAL}")
    try:
        with open(name, "xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        _put(name, path, overwrite)
    except OSError as error:
        if error.errno is not None and error.filename in (None, os.fspath(name)):
            error.filename, error.filename2 = os.fspath(path), None
        raise
    finally:
        with suppress(OSError):  # what cannot be made cannot be deleted
            os.unlink(name)


def is_remains(name: str, of: Container[str]) -> bool:
    """True if a file's name is one that a killed `write_whole` of these files leaves."""
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


def _put(name: Path, path: Path, overwrite: bool) -> None:
    if overwrite:
        os.replace(name, path)
        return
    try:
        os.link(name, path)
    except OSError:
        if path.exists():
            raise ValueError(
                f"{path} exists; accepted: a new path, or overwrite=True to replace it"
            ) from None
        os.replace(name, path)  # a file system without links
