"""Values as JSON holds them, of which tasks are made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

Plain: TypeAlias = bool | int | float | str | list[object] | dict[str, object] | None
"""A JSON value."""
Entries: TypeAlias = Mapping[str, Any]
"""Plain values by name, read."""
Given: TypeAlias = dict[str, Any]
"""Arguments by name."""
