"""The episodes of a page that was written before, to be shown again beside others."""

from __future__ import annotations

import json
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Union, cast, get_args, get_origin, get_type_hints

import numpy as np

from stickslip.envs.rendering.html import data
from stickslip.envs.rendering.html.data import Shown
from stickslip.envs.rendering.html.encode import decoded

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries

MOST_BYTES = 64 * 2**20
"""Of a page that is read."""
BEGINS, ENDS = '<script type="application/json" id="data">', "</script>"
ACCEPTED = "accepted: a page as `stickslip view ... --html FILE` writes it"


def read_episodes(path: str | Path) -> tuple[Shown, ...]:
    """The episodes of a page. ValueError naming the file where it is damaged or another file;
    nothing in it is run."""
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; {ACCEPTED}")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"{path} has {path.stat().st_size} bytes; accepted: up to {MOST_BYTES}")
    _, begun, text = path.read_text(encoding="utf-8", errors="replace").partition(BEGINS)
    text, ended, _ = text.partition(ENDS)
    if not (begun and ended):
        raise ValueError(f"{path} holds no episodes; {ACCEPTED}")
    try:
        entry = json.loads(text)["episodes"]
        episodes = cast("tuple[Shown, ...]", made(tuple[Shown, ...], entry))
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path} is damaged ({str(error)[:200]}); {ACCEPTED}") from error
    if not episodes:
        raise ValueError(f"{path} holds no episodes; accepted: a page with some")
    return episodes


def made(kind: object, entry: object) -> object:
    """What `encode.plain` made an entry of. ValueError for one of another kind."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        if entry is None and NoneType in parts:
            return None
        return made(next(part for part in parts if part is not NoneType), entry)
    if origin is tuple:
        rows = cast("list[object]", _require(entry, list))
        kinds = [parts[0]] * len(rows) if parts[-1] is Ellipsis else parts
        if len(kinds) != len(rows):
            raise ValueError(f"a list of {len(rows)}; accepted: of {len(kinds)}")
        return tuple(made(one, value) for one, value in zip(kinds, rows, strict=True))
    if kind is np.ndarray:
        return decoded(cast("Entries", _require(entry, dict)))
    if isinstance(kind, type) and is_dataclass(kind):
        given, known = cast("Entries", _require(entry, dict)), _hints(kind)
        there = [one.name for one in fields(kind) if one.name in given or _required(one)]
        return kind(**{name: made(known[name], given[name]) for name in there})
    if kind is float and isinstance(entry, int | float):
        return float(entry)
    return _require(entry, cast("type", kind))


def _required(field: Field[object]) -> bool:
    """Whether a page must have it: what came later has a default."""
    return field.default is MISSING and field.default_factory is MISSING


def _require(entry: object, kind: type) -> object:
    if not isinstance(entry, kind):
        raise ValueError(f"a {type(entry).__name__}; accepted: {kind.__name__}")
    return entry


@cache
def _hints(kind: type) -> Entries:
    return get_type_hints(kind, dict(vars(data)))
