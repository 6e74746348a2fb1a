"""Metadata of a file as JSON text that reading accepts."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from stickslip.agents.foreign.reading import LARGEST_TEXT, parse_json

if TYPE_CHECKING:
    from collections.abc import Mapping


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
