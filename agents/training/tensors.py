"""PyTorch tensors in plain containers as an .npz of arrays and one JSON text; reading runs no code.

What is kept: dictionaries with names or numbers as keys, lists, tuples, numbers, texts, None, and
tensors of the types in arrays_file.NUMBERS.
"""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.agents.foreign.arrays import arrays_in
from stickslip.agents.foreign.reading import RefusedError, parse_json, refusing
from stickslip.dynamics.checks import shown

if TYPE_CHECKING:
    from torch import Tensor

STRUCTURE = "structure"


def pack(content: dict[str, Any]) -> bytes:
    """The file's bytes. ValueError for what it cannot keep."""
    tensors: list[np.ndarray] = []
    text = json.dumps(_plain(content, tensors), allow_nan=False)
    arrays = {f"tensor_{index}": array for index, array in enumerate(tensors)}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays, **{STRUCTURE: np.array(text)})
    return file.getvalue()


def unpack(raw: bytes, largest: int) -> dict[str, Any]:
    """What `pack` packed. ValueError, without a path, for anything else.

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


def _plain(value: Any, tensors: list[np.ndarray]) -> Any:
    """JSON values: what holds others, and tensors, as a list that begins with its kind."""
    if hasattr(value, "detach"):
        tensors.append(np.ascontiguousarray(value.detach().cpu().numpy()))
        return ["tensor", len(tensors) - 1, list(tensors[-1].shape)]
    if isinstance(value, dict):
        pairs = [[_plain(key, tensors), _plain(one, tensors)] for key, one in value.items()]
        return ["dict", pairs]
    if isinstance(value, list | tuple):
        kind = "list" if isinstance(value, list) else "tuple"
        return [kind, [_plain(one, tensors) for one in value]]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ValueError(f"{shown(value)} cannot be kept; accepted: tensors, numbers and texts")


def _whole(value: Any, arrays: dict[str, np.ndarray]) -> Any:
    """The inverse; takes every tensor out of `arrays` once."""
    if not isinstance(value, list):
        if isinstance(value, dict):
            raise RefusedError(f"its {STRUCTURE} holds an object")
        return value
    kind, content, *shape = value
    if kind == "tensor":
        return _tensor(arrays.pop(f"tensor_{int(content)}"), shape[0])
    if kind == "dict":
        return {_whole(key, arrays): _whole(one, arrays) for key, one in content}
    if kind not in ("list", "tuple"):
        raise RefusedError(f"its {STRUCTURE} holds {shown(kind)}")
    parts = [_whole(one, arrays) for one in content]
    return parts if kind == "list" else tuple(parts)


def _tensor(array: np.ndarray, shape: list[int]) -> Tensor:
    import torch

    return torch.from_numpy(np.array(array.reshape(shape)))
