"""Input and output of the commands of machines: tracks, limits, folders of files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.optim.columns import columns_of
from stickslip.optim.posture.track_file import read_track
from stickslip.records.files import require_folder as require_no_file
from stickslip.records.files import require_makeable, write_whole

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

OPTION = "name=value, the value a number or a word"


def track_of(name: str, options: Iterable[str] = (), columns: str | None = None) -> Track:
    """The named track, or the one in the file of that name.

    options: "name=value" each; of Track.named, or `interpolation` for a file. columns: of a file,
    "x=HEAD,y=HEAD". ValueError for what is unknown, OSError where the file cannot be read.
    """
    given = track_options_of(options)
    if name in TRACKS:
        if columns is not None:
            raise ValueError(f"--columns {columns} with --track {name}; accepted: with a file")
        try:
            return Track.named(name, **given)
        except TypeError as error:
            raise ValueError(f"track {name!r} with {given}: {error}") from error
    path = Path(name)
    if not path.exists():
        raise ValueError(
            f"track {name!r} is neither a name nor a file; accepted: {', '.join(TRACKS)}, or a "
            "file of points (x and y, or GPX)"
        )
    unknown = [key for key in given if key != "interpolation"]
    if unknown:
        raise ValueError(f"a track in a file has no {unknown[0]!r}; accepted: interpolation")
    return read_track(path, **given, columns=columns_of(columns))


def track_options_of(words: Iterable[str]) -> dict[str, Any]:
    """name=value words as names and numbers or text; the last one counts."""
    found = {}
    for word in words:
        name, sign, value = word.partition("=")
        if not (sign and name.strip() and value.strip()):
            raise ValueError(f"--track-option {word!r}; accepted: {OPTION}")
        found[name.strip()] = _number(value)
    return found


def _number(text: str) -> int | float | str:
    """A whole number, a number, or the text as it is."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text.strip()


def require_folder(path: str, overwrite: bool) -> Path:
    """The folder for the files; ValueError if something is there and may not be replaced."""
    out = Path(path)
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
