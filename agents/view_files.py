"""Checks of the files and folders that commands write, before anything is computed."""

from __future__ import annotations

import os
import sys
import tempfile
from contextlib import suppress
from errno import ENOTDIR
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


FILES = (".csv", ".json", ".parquet", ".html", ".htm", ".md", ".txt", ".png", ".gif", ".npz")
"""What no directory of results is called."""


def require_new(paths: Sequence[Path], overwrite: bool) -> None:
    """Raise ValueError for a path that exists and is not to be replaced."""
    for path in paths:
        if path.exists() and not overwrite:
            raise ValueError(f"{path} exists; accepted: a new path, or --overwrite to replace it")


def require_writable(paths: Sequence[Path]) -> None:
    """Raise OSError naming the file where it cannot be written, before anything is computed."""
    for folder, path in {path.parent: path for path in paths}.items():
        new = not folder.exists()
        _require_room(folder, path)
        if new:
            print(f"New folder: {folder}", file=sys.stderr)


def require_makeable(folder: Path) -> None:
    """Raise OSError naming the folder where it cannot be made or written to; nothing is left."""
    new = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        _require_room(folder, folder)
    finally:
        for one in new:
            with suppress(OSError):
                one.rmdir()


def _require_room(folder: Path, path: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:  # it names the file that was tried, of which nobody knows
        why = os.strerror(ENOTDIR) if isinstance(error, FileExistsError) else error.strerror
        raise OSError(error.errno, f"cannot be written ({why})", str(path)) from error


def require_folder(out: str | Path) -> None:
    """Raise ValueError for an --out that is to be a directory and is named as a file."""
    path = Path(out)
    if path.suffix.lower() in FILES and not path.is_dir():
        raise ValueError(
            f"--out {path} ends in {path.suffix!r}; accepted: a directory, in which the files get "
            "names of their own"
        )


def require_suffix(path: Path, accepted: tuple[str, ...]) -> None:
    """Raise ValueError for a path of another kind."""
    if path.suffix.lower() not in accepted:
        raise ValueError(f"{path} ends in {path.suffix!r}; accepted: {', '.join(accepted)}")
