"""Values as JSON holds them, of which tasks are made."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Any

Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"
"""What JSON holds."""
Entries: TypeAlias = "Mapping[str, Any]"
"""Plain values by name, read."""
Given: TypeAlias = "dict[str, Any]"
"""What is made of them: arguments by name."""
