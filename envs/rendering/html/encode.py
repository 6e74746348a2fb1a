"""Arrays as text for a page: 16 bits a number, 32 a place, as base64 within JSON."""

from __future__ import annotations

import base64
import json
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from stickslip.envs.plain import Entries

LEVELS = 65534
"""Steps between the least and the greatest number; the code above them stands for "none"."""


def encoded(values: np.ndarray) -> Entries:
    """An array as {"shape", "low", "step", "data"}: a number is low + step x its code.

    In single precision it is kept as it is, little-endian, and low and step are None. Else it is
    rounded to the nearest of 65535 levels between the least and the greatest, so no number moves
    by more than (greatest - least) / 131068; whole numbers and truth values in such a range are
    exact. Codes are little-endian unsigned 16-bit integers, 65535 where a number is not finite.
    """
    values = np.asarray(values)
    if values.dtype == np.float32:
        data = base64.b64encode(values.astype("<f4").tobytes()).decode()
        return {"shape": list(values.shape), "low": None, "step": None, "data": data}
    whole = values.dtype.kind in "iub"
    numbers = values.astype(float)
    sound = np.isfinite(numbers)
    low, high = (numbers[sound].min(), numbers[sound].max()) if sound.any() else (0.0, 0.0)
    step = (high - low) / LEVELS
    if whole and high - low <= LEVELS:
        step = 1.0
    step = step if step > 0 and np.isfinite(step) else 1.0
    codes = np.full(numbers.shape, LEVELS + 1, "<u2")
    codes[sound] = np.rint((numbers[sound] - low) / step).clip(0, LEVELS).astype("<u2")
    return {
        "shape": list(values.shape),
        "low": float(low),
        "step": float(step),
        "data": base64.b64encode(codes.tobytes()).decode(),
    }


def decoded(entry: Entries) -> np.ndarray:
    """The array of `encoded`, float64 or float32 as it was; NaN for what was not finite."""
    if entry["step"] is None:
        return np.frombuffer(base64.b64decode(entry["data"]), "<f4").reshape(entry["shape"])
    codes = np.frombuffer(base64.b64decode(entry["data"]), "<u2").reshape(entry["shape"])
    values = entry["low"] + entry["step"] * codes.astype(float)
    return np.where(codes > LEVELS, np.nan, values)


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
