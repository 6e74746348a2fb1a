"""Shared parts of `stickslip optimise`: output files, and limits as flags."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from stickslip.agents.view_files import require_folder as require_no_file
from stickslip.agents.view_files import require_makeable
from stickslip.dynamics.checks import shown
from stickslip.records.files import write_whole

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

NO_LIMIT = "none"


def limit_of(flag: str, text: str, unit: str) -> float | None:
    """A limit, or None for none; ValueError naming the flag."""
    if text == NO_LIMIT:
        return None
    try:
        return float(text)
    except ValueError:
        raise ValueError(
            f"{flag} {shown(text)}; accepted: a number > 0 [{unit}], or {NO_LIMIT}"
        ) from None


def require_folder(out: Path, overwrite: bool) -> Path:
    """The folder for the files; ValueError if something is there and may not be replaced."""
    require_no_file(out)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out} is a file; accepted: a directory, or a new path, for --out")
    if not overwrite and out.is_dir() and any(out.iterdir()):
        raise ValueError(f"{out} exists; accepted: another --out, or --overwrite to replace")
    require_makeable(out)
    return out


def write_all(
    out: Path, files: Mapping[str, bytes | str], usual: tuple[str, ...], overwrite: bool
) -> None:
    """Write the files, each whole, and say where. usual: names of all that a command may write;
    overwriting, nothing of an earlier result stays beside this one."""
    if overwrite:
        for name in set(usual) - set(files):
            (out / name).unlink(missing_ok=True)
    for name, content in files.items():
        write_whole(out / name, content, overwrite=overwrite)
    print(f"{', '.join(files)}: {out}", file=sys.stderr)
