"""Input and output of the commands of machines: tracks, limits, folders of files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.commands import NOTHING_FOUND, OK
from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.optim.columns import columns_of
from stickslip.optim.posture.track_file import read_track
from stickslip.optim.progress import say_stage
from stickslip.records.files import require_folder as require_no_file
from stickslip.records.files import require_makeable, write_whole
from stickslip.records.table import Column, Content, Table, json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from stickslip.optimise.flags import Output

RESULT = "result.json"
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


def finished(
    out: Path,
    given: Output,
    lines: list[tuple[str, str]],
    said: list[str],
    found: dict[str, Any],
    units: dict[str, Any],
    tables: Mapping[str, str],
    usual: tuple[str, ...],
    picture: tuple[str, Callable[[], tuple[Any, str]]] | None,
) -> Content:
    """Print a result and its warnings, write it, and say where; NOTHING_FOUND without a picture.

    found: of result.json. tables: further files. usual: names of all that a command may write;
    overwriting, nothing of an earlier result stays beside this one. picture: name, and what draws
    the figure and its title.
    """
    columns = [Column("name", words=True), Column("value", words=True)]
    print(Table(columns, [line for line in lines if line[1]]).terminal(head=False), end="")
    for one in said:
        print(f"warning: {one}", file=sys.stderr)
    files: dict[str, bytes | str] = {RESULT: json_text(found), **tables}
    if picture is not None and given.pictures:
        from stickslip.envs.rendering.sheet import png

        say_stage("drawing")
        files[picture[0]] = png(*picture[1]())
    if given.overwrite:
        for name in {RESULT, *usual} - set(files):
            (out / name).unlink(missing_ok=True)
    for name, content in files.items():
        write_whole(out / name, content, overwrite=given.overwrite)
    print(f"{', '.join(files)}: {out}", file=sys.stderr)
    facts = found | {"files": [str(out / name) for name in files]}
    return Content(facts=facts, units=units, status=NOTHING_FOUND if picture is None else OK)
