"""Arrays as text for a page: single precision as base64 within JSON."""

from __future__ import annotations

import base64
import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries


def encoded(values: np.ndarray) -> Entries:
    """Encode an array as {"shape", "data"}: little-endian float32 in base64."""
    data = base64.b64encode(np.asarray(values).astype("<f4").tobytes()).decode()
    return {"shape": list(np.shape(values)), "data": data}


def plain(value: object) -> object:
    """Dataclasses as dictionaries, arrays encoded, the rest as JSON knows it."""
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: plain(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, np.ndarray):
        return encoded(value)
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def script_text(value: object) -> str:
    """JSON that may stand within a <script>: no character that could end it or begin a comment."""
    text = json.dumps(plain(value), ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
