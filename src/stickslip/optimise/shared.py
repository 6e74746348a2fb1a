"""Tracks by name or from a file, as flags give them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from stickslip.dynamics.ugv import TRACKS, Track
from stickslip.optim.columns import columns_of
from stickslip.optim.posture.track_file import read_track

if TYPE_CHECKING:
    from collections.abc import Iterable

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
