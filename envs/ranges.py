"""Ranges (low, high) that a reset draws from."""

from __future__ import annotations

from typing import Any

import numpy as np

from stickslip.dynamics.checks import is_concrete, require_number, shown
from stickslip.dynamics.numeric import Numeric, require_broadcast, require_numeric

Range = tuple[Numeric, Numeric]


def require_range(
    name: str, given: Any, low: float = -np.inf, strict: bool = False, optional: bool = True
) -> None:
    """Raise ValueError unless `given` is (low, high), finite and in order, or None if optional."""
    if given is None and optional:
        return
    accepted = f"(low, high), finite, low <= high, low {'>' if strict else '>='} {low}"
    if not isinstance(given, tuple) or len(given) != 2:
        raise ValueError(f"{name} = {shown(given)} is no range; accepted: {accepted}")
    for end in given:
        require_number(name, end, low=low, strict=strict, accepted=accepted)
        require_numeric(**{name: end})
    require_broadcast(**{f"{name}[0]": given[0], f"{name}[1]": given[1]})
    if is_concrete(given) and np.any(np.asarray(given[0]) > np.asarray(given[1])):
        raise ValueError(f"{name} = {shown(given)} has low > high; accepted: {accepted}")
