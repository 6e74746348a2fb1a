"""Read back what a page holds, for tests."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np


def page_data(path: str | Path) -> dict[str, Any]:
    """The page's JSON, arrays decoded."""
    text = Path(path).read_text(encoding="utf-8")
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text)
    return json.loads(found, object_hook=_decoded)


def read_episodes(path: str | Path) -> list[SimpleNamespace]:
    """The page's episodes, with attributes as in `Episode`."""
    return [_attributes(one) for one in page_data(path)["episodes"]]


def _decoded(entry: dict[str, Any]) -> Any:
    if entry.keys() != {"shape", "data"}:
        return entry
    return np.frombuffer(base64.b64decode(entry["data"]), "<f4").reshape(entry["shape"])


def _attributes(value: Any) -> Any:
    if isinstance(value, dict):
        return SimpleNamespace(**{name: _attributes(one) for name, one in value.items()})
    return [_attributes(one) for one in value] if isinstance(value, list) else value
