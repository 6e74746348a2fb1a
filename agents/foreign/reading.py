"""Reading what somebody else may have written: every failure is one ValueError.

Either `RefusedError`, raised by a reader on purpose, whose words are for the user; or whatever a
parser raises on bytes that it was not made for, of any kind (memory, recursion, a codec's own
error), which `refusing` turns into one.
"""

from __future__ import annotations

import json
import math
import os
import re
import stat
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from stickslip.dynamics.plain_checks import require_known, shown

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from stickslip.agents.foreign.rules import Rule

Json: TypeAlias = "dict[str, Json] | list[Json] | str | float | bool | None"
"""The value of a JSON text."""
LARGEST_TEXT = 4 * 2**20
"""Bytes of a JSON text."""
LARGEST_TABLE = 64 * 2**20
"""Bytes of a CSV file."""
DEEPEST = 32
"""Lists and objects within one another in a JSON text."""
LONGEST_NUMBER = 40
"""Characters of a number in a JSON text."""
STRINGS = re.compile(rb'"(?:[^"\\]|\\.)*+(?:"|\\?\Z)', re.DOTALL)


class RefusedError(ValueError):
    """Untrusted input was refused; the message says why."""


@contextmanager
def refusing(what: str) -> Iterator[None]:
    """Inside, whatever goes wrong while foreign bytes are read becomes one ValueError.

    What is meant by the reader itself (RefusedError) passes; for anything else, `what` is damaged.
    """
    try:
        yield
    except (RefusedError, Warning):  # where warnings are errors, they are not the file's
        raise
    except Exception as error:
        words = " ".join(str(error)[:500].split())
        reason = f"{type(error).__name__}: {words}" if words else type(error).__name__
        raise RefusedError(f"{what} is damaged ({reason[:160]})") from error


def read_bytes(path: str | Path, largest: int) -> bytes:
    """The contents of a plain file of at most so many bytes. RefusedError without the path.

    Neither waits at a pipe nor reads a device without end.
    """
    try:
        handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | _BINARY)
        with os.fdopen(handle, "rb") as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise RefusedError("cannot be read (not a plain file)")
            raw = file.read(largest + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise RefusedError("no such file") from None
    except RefusedError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        reason = error.strerror if isinstance(error, OSError) else error
        raise RefusedError(f"cannot be read ({reason})") from error
    if len(raw) > largest:
        raise RefusedError(f"larger than {largest} bytes")
    return raw


_BINARY = getattr(os, "O_BINARY", 0)


def read_text(path: str | Path, largest: int = LARGEST_TEXT) -> str:
    """The UTF-8 text of a plain file; RefusedError without the path."""
    try:
        return read_bytes(path, largest).decode()
    except UnicodeDecodeError as error:
        raise RefusedError("cannot be read (no UTF-8 text)") from error


def parse_json(text: str, what: str) -> Json:
    """The value of a JSON text by the letter: finite numbers, whole characters, bounded size.

    Size and depth are looked at before anything is built. what: for the message of a RefusedError.
    """
    with refusing(what):
        raw = text.encode()
        if len(raw) > LARGEST_TEXT:
            raise RefusedError(f"{what} is longer than {LARGEST_TEXT} bytes")
        if depth_of(raw) > DEEPEST:
            raise RefusedError(f"{what} is JSON nested deeper than {DEEPEST}")
        try:
            value = json.loads(
                text, parse_int=_whole, parse_float=_finite, parse_constant=_no_number
            )
        except json.JSONDecodeError as error:
            raise RefusedError(f"{what} is no JSON ({error})") from error
        if re.search(r"\\u[dD][89a-fA-F]", text):
            json.dumps(value, ensure_ascii=False).encode()  # half a character cannot be shown
        return value


def depth_of(raw: bytes) -> int:
    """Nesting depth of a JSON text, ignoring brackets in strings."""
    import numpy as np  # help reads configurations without it

    marks = np.frombuffer(STRINGS.sub(b"", raw), np.uint8)
    opened = np.isin(marks, tuple(b"[{")).astype(np.int32) - np.isin(marks, tuple(b"]}"))
    return int(np.max(np.cumsum(opened), initial=0))


def metadata_text(own: Mapping[str, object], extra: Mapping[str, object] | None) -> str:
    """The text of both. own: what the file says; extra: a caller's JSON values under other names,
    ValueError where they are none or take a name of the file's own."""
    extra = dict(extra or {})
    if taken := sorted(own.keys() & extra.keys()):
        raise ValueError(f"metadata names {', '.join(taken)}; accepted: any but {', '.join(own)}")
    try:
        text = json.dumps({**own, **extra}, allow_nan=False, ensure_ascii=False)
        parse_json(text, "metadata")
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(
            f"metadata is no JSON ({error}); accepted: finite JSON values, at most "
            f"{LARGEST_TEXT} bytes"
        ) from error
    return text


def require_head(content: Json, form: str, version: int, kind: str) -> dict[str, Json]:
    """The other entries of an object that says of which format and version it is."""
    whole = require_format(content, form, version, kind)
    return {name: value for name, value in whole.items() if name not in ("format", "version")}


def require_format(content: Json, form: str, version: int, kind: str) -> dict[str, Json]:
    """The object, if it says that it is of this format and version."""
    if not isinstance(content, dict) or content.get("format") != form:
        raise RefusedError(f"it does not say that it is {kind}")
    if (found := content.get("version")) != version or isinstance(found, bool):
        raise RefusedError(f"its version is {shown(found)}, this is version {version}")
    return content


def require_entries(content: Mapping[str, Json], rules: Mapping[str, Rule]) -> dict[str, Any]:
    """The entries: all of the rules' names and no others, each as its rule has it."""
    try:
        require_known(content, rules)
        if missing := [name for name in rules if name not in content]:
            raise RefusedError(f"it lacks {', '.join(missing)}")
        return {name: rule.require(name, content[name]) for name, rule in rules.items()}
    except ValueError as error:
        raise RefusedError(str(error)) from error


def _whole(digits: str) -> int:
    _require_short(digits)
    return int(digits)


def _finite(digits: str) -> float:
    _require_short(digits)
    if not math.isfinite(value := float(digits)):
        _no_number(digits)
    return value


def _require_short(digits: str) -> None:
    if len(digits) > LONGEST_NUMBER:
        raise RefusedError(f"a number of {len(digits)} digits; accepted: at most {LONGEST_NUMBER}")


def _no_number(word: str) -> NoReturn:
    raise RefusedError(f"{word} is not a finite number")
