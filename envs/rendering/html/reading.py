"""The episodes of a page that was written before, to be shown again beside others."""

from __future__ import annotations

import json
import re
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import numpy as np

from stickslip.envs.rendering.html import data
from stickslip.envs.rendering.html.data import Shown
from stickslip.envs.rendering.html.encode import decoded

MOST_BYTES = 200_000_000
"""Of a page that is read."""
DATA = re.compile(r'<script type="application/json" id="data">(.*?)</script>', re.DOTALL)
ACCEPTED = "accepted: a page as `stickslip view ... --html FILE` writes it"


def read_episodes(path: str | Path) -> tuple[Shown, ...]:
    """The episodes of a page. ValueError naming the file where it is damaged or another file;
    nothing in it is run."""
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"{path} is no file; {ACCEPTED}")
    if path.stat().st_size > MOST_BYTES:
        raise ValueError(f"{path} has {path.stat().st_size} bytes; accepted: up to {MOST_BYTES}")
    found = DATA.search(path.read_text(encoding="utf-8", errors="replace"))
    if found is None:
        raise ValueError(f"{path} holds no episodes; {ACCEPTED}")
    try:
        episodes = made(tuple[Shown, ...], json.loads(found.group(1))["episodes"])
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path} is damaged ({str(error)[:200]}); {ACCEPTED}") from error
    if not episodes:
        raise ValueError(f"{path} holds no episodes; accepted: a page with some")
    return episodes


def made(kind: Any, entry: Any) -> Any:
    """What `encode.plain` made an entry of. ValueError for one of another kind."""
    origin, parts = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        if entry is None and NoneType in parts:
            return None
        (kind,) = (part for part in parts if part is not NoneType)
        return made(kind, entry)
    if kind is np.ndarray:
        return decoded(entry)
    if origin is tuple:
        repeated = parts[-1] is Ellipsis
        kinds = [parts[0]] * len(entry) if repeated else parts
        if not isinstance(entry, list) or len(kinds) != len(entry):
            raise ValueError(f"a list of {len(entry)}; accepted: of {len(kinds)}")
        return tuple(made(one, value) for one, value in zip(kinds, entry, strict=True))
    if is_dataclass(kind):
        known = _hints(kind)
        return kind(**{one.name: made(known[one.name], entry[one.name]) for one in fields(kind)})  # pyright: ignore[reportCallIssue], a class
    if kind is float and isinstance(entry, int | float):
        return float(entry)
    if not isinstance(entry, kind):
        raise ValueError(f"a {type(entry).__name__}; accepted: {kind.__name__}")
    return entry


@cache
def _hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind, vars(data))
