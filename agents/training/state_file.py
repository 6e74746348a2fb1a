"""Arrays in plain containers as an .npz of arrays and one JSON text; reading runs no code.

What is kept: dictionaries with names or numbers as keys, lists, tuples, numbers, texts, None, and
arrays of the types in foreign/arrays.py.
"""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from stickslip.agents.foreign.arrays import arrays_in
from stickslip.agents.foreign.reading import RefusedError, parse_json, refusing
from stickslip.dynamics.checks import shown

if TYPE_CHECKING:
    from stickslip.agents.foreign.reading import Json

Container: TypeAlias = "dict[str, Plain] | dict[int, Plain] | list[Plain] | tuple[Plain, ...]"
Plain: TypeAlias = "Container | np.ndarray | str | float | bool | None"
"""Arrays in plain containers."""
ModelState: TypeAlias = "dict[str, Plain]"
"""All that learning goes on from."""
STRUCTURE = "structure"


def pack(content: ModelState) -> bytes:
    """The file's bytes. ValueError for what it cannot keep."""
    found: list[np.ndarray] = []
    text = json.dumps(_plain(content, found), allow_nan=False)
    arrays = {f"tensor_{index}": array for index, array in enumerate(found)}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays, **{STRUCTURE: np.array(text)})
    return file.getvalue()


def unpack(raw: bytes, largest: int) -> ModelState:
    """Inverse of `pack`. ValueError, without a path, for anything else.

    largest: bytes that the file and its contents may have.
    """
    with refusing("it"):
        arrays = arrays_in(raw, largest)
        text = arrays.pop(STRUCTURE, None)
        if text is None or text.shape != () or text.dtype.kind != "U":
            raise RefusedError(f"no {STRUCTURE} among its entries")
        content = _whole(parse_json(str(text), f"its {STRUCTURE}"), arrays)
        if arrays or not isinstance(content, dict):
            raise RefusedError(f"its {STRUCTURE} does not fit its {len(arrays)} other entries")
        return content


def _plain(value: Plain, arrays: list[np.ndarray]) -> Json:
    """JSON values: what holds others, and arrays, as a list that begins with its kind."""
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return ["tensor", len(arrays) - 1, list(value.shape)]
    if isinstance(value, dict):
        pairs: Json = [[_plain(key, arrays), _plain(one, arrays)] for key, one in value.items()]
        return ["dict", pairs]
    if isinstance(value, list | tuple):
        kind = "list" if isinstance(value, list) else "tuple"
        return [kind, [_plain(one, arrays) for one in value]]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ValueError(f"{shown(value)} cannot be kept; accepted: arrays, numbers and texts")


def _whole(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    """The inverse; takes every array out of `arrays` once."""
    if not isinstance(value, list):
        if isinstance(value, dict):
            raise RefusedError(f"its {STRUCTURE} holds an object")
        return value
    kind, content, *shape = value
    if kind == "tensor":
        return np.array(arrays.pop(f"tensor_{int(content)}").reshape(shape[0]))
    if kind == "dict":
        return {_whole(key, arrays): _whole(one, arrays) for key, one in content}
    if kind not in ("list", "tuple"):
        raise RefusedError(f"its {STRUCTURE} holds {shown(kind)}")
    parts = [_whole(one, arrays) for one in content]
    return parts if kind == "list" else tuple(parts)
