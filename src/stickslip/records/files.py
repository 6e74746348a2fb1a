"""Files that commands write: checked before anything is computed, and written atomically."""

import os
import re
import secrets
import tempfile
from collections.abc import Container, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import ENOTDIR
from pathlib import Path
from typing import IO

PARTIAL = ".part"
LONGEST_NAME = 255
"""Bytes of a file's name that file systems take."""
FILES = (".csv", ".json", ".parquet", ".html", ".htm", ".md", ".txt", ".png", ".gif", ".npz")
"""Suffixes that no directory of results has."""
REMAINS = re.compile(r"\.(.+)-[^-]{1,16}\.part", re.DOTALL)


def write_whole(
    path: str | os.PathLike[str], content: bytes | str, *, overwrite: bool = True
) -> Path:
    """Write a file whole or not at all, see `writing`. Text is written as UTF-8."""
    with writing(path, overwrite=overwrite) as file:
        file.write(content.encode() if isinstance(content, str) else content)
    return Path(path)


@contextmanager
def writing(path: str | os.PathLike[str], *, overwrite: bool = True) -> Iterator[IO[bytes]]:
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


def is_remains(name: str, of: Container[str] | None = None) -> bool:
    """True if a file's name is one that a killed `write_whole` leaves; of: of these files alone."""
    found = REMAINS.fullmatch(name)
    return found is not None and (of is None or found.group(1) in of)


def _put(name: Path, path: Path, overwrite: bool) -> None:
    if overwrite:
        os.replace(name, path)
        return
    try:
        os.link(name, path)
    except OSError:
        if path.exists():
            raise ValueError(
                f"{path} exists; accepted: a new path, or overwrite=True (--overwrite)"
            ) from None
        os.replace(name, path)  # a file system without links


def require_new(paths: Sequence[Path], overwrite: bool) -> None:
    """Raise ValueError for a path that exists and is not to be replaced."""
    for path in paths:
        if path.exists() and not overwrite:
            raise ValueError(f"{path} exists; accepted: a new path, or --overwrite to replace it")


def require_writable(paths: Sequence[Path], overwrite: bool = True) -> None:
    """Raise OSError naming the file where it cannot be written, before anything is computed;
    overwrite: as of `require_new`."""
    require_new(paths, overwrite)
    for folder, path in {path.parent: path for path in paths}.items():
        require_makeable(folder, path)


def require_makeable(folder: Path, path: Path | None = None) -> None:
    """Write to a folder and leave nothing there. OSError naming `path`, or the folder, where it
    cannot be made or written to."""
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:  # it names the file that was tried, of which nobody knows
        why = os.strerror(ENOTDIR) if isinstance(error, FileExistsError) else error.strerror
        raise OSError(error.errno, f"cannot be written ({why})", str(path or folder)) from error
    finally:
        for one in new:
            with suppress(OSError):
                one.rmdir()


def require_folder(out: str | Path) -> None:
    """Raise ValueError for an --out that is to be a directory and is named as a file."""
    path = Path(out)
    if path.suffix.lower() in FILES and not path.is_dir():
        accepted = "a directory, in which the files get names of their own"
        raise ValueError(f"--out {path} ends in {path.suffix!r}; accepted: {accepted}")


def require_suffix(path: Path, accepted: tuple[str, ...]) -> None:
    """Raise ValueError for a path of another kind."""
    if path.suffix.lower() not in accepted:
        what = f"ends in {path.suffix!r}" if path.suffix else "has no ending"
        raise ValueError(f"{path} {what}; accepted: {', '.join(accepted)}")
