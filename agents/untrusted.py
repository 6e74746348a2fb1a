"""Read files that somebody else may have written: bounded, as data, every failure one ValueError.

`RefusedError` is raised by a reader on purpose; its message is for the user. `refusing` turns any
other error that damaged bytes cause in a parser into one. Sizes are checked before memory is
allocated. NumPy reads arrays with pickles refused, since these would run code.
"""

from __future__ import annotations

import io
import json
import math
import os
import re
import stat
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from stickslip.dynamics import checks

if TYPE_CHECKING:
    import numpy as np

Json: TypeAlias = "dict[str, Json] | list[Json] | str | float | bool | None"
"""The value of a JSON text."""
LARGEST_TEXT = 4 * 2**20
"""Bytes of a JSON text."""
LARGEST_TABLE = 64 * 2**20
"""Bytes of a CSV file."""
LARGEST = 64 * 2**20
"""Bytes of an .npz file, packed and unpacked, unless the reader says otherwise."""
MOST_ENTRIES = 1024
ENTRY = b"PK\x01\x02"
"""Begins each entry of an archive's directory; by chance also stands in one array out of 10^8."""
NUMBERS = ("<f4", "<f8", "<i4", "<i8", "<u4", "|u1", "|b1")
MOST = 2**53
"""Upper bound of integers where a rule has none: each is a float, too."""


class RefusedError(ValueError):
    """Untrusted input was refused; the message says why."""


@contextmanager
def refusing(what: str) -> Iterator[None]:
    """Turn every error while untrusted bytes are read into a RefusedError that names `what`."""
    try:
        yield
    except (RefusedError, Warning):  # where warnings are errors, they are not the file's
        raise
    except Exception as error:
        words = " ".join(str(error)[:500].split())
        reason = f"{type(error).__name__}: {words}" if words else type(error).__name__
        raise RefusedError(f"{what} is damaged ({reason[:160]})") from error


@contextmanager
def reading(path: str | Path, accepted: str, what: str = "it") -> Iterator[None]:
    """Inside, every failure is a ValueError that names the file and says what is accepted."""
    with checks.reraise(f"{path}: ", f"; accepted: {accepted}"), refusing(what):
        yield


def read_bytes(path: str | Path, largest: int = LARGEST) -> bytes:
    """The contents of a plain file of at most `largest` bytes. RefusedError without the path.

    Does not wait at a pipe.
    """
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
    try:
        with os.fdopen(os.open(path, flags), "rb") as file:
            plain = stat.S_ISREG(os.fstat(file.fileno()).st_mode)
            raw = file.read(largest + 1) if plain else b""
    except (FileNotFoundError, NotADirectoryError):
        raise RefusedError("no such file") from None
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        reason = error.strerror if isinstance(error, OSError) else error
        raise RefusedError(f"cannot be read ({reason})") from error
    if not plain:
        raise RefusedError("cannot be read (not a plain file)")
    if len(raw) > largest:
        raise RefusedError(f"larger than {largest} bytes")
    return raw


def read_text(path: str | Path, largest: int = LARGEST_TEXT) -> str:
    """The UTF-8 text of a plain file; RefusedError without the path."""
    try:
        return read_bytes(path, largest).decode()
    except UnicodeDecodeError as error:
        raise RefusedError("cannot be read (no UTF-8 text)") from error


def parse_json(text: str, what: str) -> Json:
    """The value of a JSON text of bounded size and finite numbers; `what` names it in messages."""
    with refusing(what):
        if len(text.encode()) > LARGEST_TEXT:
            raise RefusedError(f"{what} is longer than {LARGEST_TEXT} bytes")
        try:
            value = json.loads(text, parse_float=_finite, parse_constant=_finite)
        except json.JSONDecodeError as error:
            raise RefusedError(f"{what} is no JSON ({error})") from error
        if re.search(r"\\u[dD][89a-fA-F]", text):
            json.dumps(value, ensure_ascii=False).encode()  # half a character cannot be printed
        return value


def _finite(digits: str) -> float:
    if not math.isfinite(value := float(digits)):
        raise RefusedError(f"{digits[:80]} is not a finite number")
    return value


def metadata_text(own: Mapping[str, object], extra: Mapping[str, object] | None) -> str:
    """JSON text of a file's own entries and of a caller's, which need other names."""
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


def require_format(content: Json, form: str, version: int, kind: str) -> dict[str, Json]:
    """The object, if it says that it is of this format and version."""
    if not isinstance(content, dict) or content.get("format") != form:
        raise RefusedError(f"it does not say that it is {kind}")
    if (found := content.get("version")) != version or isinstance(found, bool):
        raise RefusedError(f"its version is {checks.shown(found)}, this is version {version}")
    return content


def require_head(content: Json, form: str, version: int, kind: str) -> dict[str, Json]:
    """The other entries of such an object."""
    whole = require_format(content, form, version, kind)
    return {name: value for name, value in whole.items() if name not in ("format", "version")}


Kind: TypeAlias = type[bool] | type[int] | type[float] | type[str] | Literal["range"]
"""Kind of a value; "range": two numbers, low <= high."""


@dataclass(frozen=True)
class Rule:
    """Accepted values of a field of a configuration or a file."""

    kind: Kind
    about: str
    low: float = -math.inf
    high: float = math.inf
    strict: bool = False
    """The lowest value is itself excluded."""
    optional: bool = False
    choices: tuple[str, ...] = ()

    @property
    def accepted(self) -> str:
        """Accepted values in words."""
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is bool or self.kind is str:
            return "true or false" if self.kind is bool else "a name"
        words = "an integer" if self.kind is int else "finite"
        words += "" if self.low == -math.inf else f", {'>' if self.strict else '>='} {self.low:g}"
        words += "" if self.high == math.inf else f", <= {self.high:g}"
        words = f"two numbers low <= high, {words}" if self.kind == "range" else words
        return f"{words}, or nothing" if self.optional else words

    def require(self, name: str, value: object) -> Any:
        """The value, or ValueError naming the field, the value and what is accepted."""
        if value is None and self.optional:
            return None
        if self.choices:
            checks.require_choice(name, value, self.choices)
        elif self.kind is bool or self.kind is str:
            checks.require_kind(name, value, self.kind, self.accepted)
        elif self.kind is int:
            low, high = int(max(self.low, -MOST)), int(min(self.high, MOST))
            return checks.require_integer(name, value, low=low, high=high, accepted=self.accepted)
        else:
            return self._range(name, value) if self.kind == "range" else self._number(name, value)
        return value

    def _number(self, name: str, value: Any) -> float:
        checks.require_kind(name, value, (int, float), self.accepted)
        limits = {"low": self.low, "high": self.high, "strict": self.strict}
        checks.require_number(name, value, **limits, accepted=self.accepted)
        return float(value)

    def _range(self, name: str, value: Any) -> tuple[float, float]:
        pair = isinstance(value, tuple | list) and len(value) == 2
        checks.require_kind(name, value, (tuple, list) if pair else (), self.accepted)
        low, high = (self._number(name, end) for end in value)
        if low > high:
            raise ValueError(f"{name} = {(low, high)} has low > high; accepted: {self.accepted}")
        return low, high


def require_entries(
    content: Mapping[str, Json], rules: Mapping[str, Rule], also: str | None = None
) -> dict[str, Any]:
    """The entries of the rules' names, each as its rule has it, None for an optional one that is
    not there. RefusedError for one that lacks, and for others; also: accepted, for the caller."""
    with checks.reraise("", kind=RefusedError):
        checks.require_known(content, [*rules, also] if also else rules)
        if missing := [k for k, rule in rules.items() if not (rule.optional or k in content)]:
            raise RefusedError(f"it lacks {', '.join(missing)}")
        return {name: rule.require(name, content.get(name)) for name, rule in rules.items()}


METADATA = "metadata"


def pack(content: Mapping[str, np.ndarray | Json]) -> bytes:
    """An .npz file of arrays by name, and of JSON values in one text. Inverse of `unpack`."""
    import numpy as np

    arrays = {name: one for name, one in content.items() if isinstance(one, np.ndarray)}
    rest = {name: one for name, one in content.items() if name not in arrays}
    text = json.dumps(rest, allow_nan=False)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays, **{METADATA: np.array(text)})
    return file.getvalue()


def unpack(raw: bytes, largest: int = LARGEST) -> dict[str, Any]:
    """Arrays and JSON values by name. RefusedError, without a path, for anything else."""
    arrays, rest = arrays_and_metadata(raw, largest)
    if not isinstance(rest, dict) or rest.keys() & arrays.keys():
        raise RefusedError(f"its {METADATA} is no object of other names")
    return {**rest, **arrays}


def arrays_and_metadata(raw: bytes, largest: int = LARGEST) -> tuple[dict[str, np.ndarray], Json]:
    """Arrays of an .npz file, little-endian numbers (NUMBERS) and text, and its JSON text's value.

    RefusedError for anything else, and for more than `largest` bytes packed or unpacked. Each entry
    is read up to the size that the archive declares, into memory that grows as it is written.
    """
    import numpy as np

    if len(raw) > largest:
        raise RefusedError(f"larger than {largest} bytes")
    if raw.count(ENTRY) > 2 * MOST_ENTRIES:
        raise RefusedError(f"an archive of more than {MOST_ENTRIES} entries")
    with refusing("the .npz archive"):
        with zipfile.ZipFile(io.BytesIO(raw)) as archive:
            if sum(member.file_size for member in archive.infolist()) > largest:
                raise RefusedError(f"unpacks to more than {largest} bytes")
        with np.load(io.BytesIO(raw), allow_pickle=False) as archive:
            found = dict(archive)
    for name, one in found.items():
        if not isinstance(one, np.ndarray):
            raise RefusedError(f"its entry {name[:80]!r} is no array")
        if (one.dtype.str not in NUMBERS and one.dtype.kind != "U") or not one.dtype.itemsize:
            raise RefusedError(f"its entry {name[:80]!r} holds {one.dtype.str}; accepted: numbers")
    text = found.pop(METADATA, None)
    if text is None or text.shape != () or text.dtype.kind != "U":
        raise RefusedError(f"no {METADATA} among its entries ({checks.shown(sorted(found))})")
    return found, parse_json(str(text), f"its {METADATA}")
