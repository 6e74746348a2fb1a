"""Parts of every environment's parameters: time limit, numbers, ranges that a reset draws from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from stickslip.dynamics.checks import as_number, is_concrete, require_number, shown
from stickslip.dynamics.pytrees import Numeric, require_broadcast, require_numeric

if TYPE_CHECKING:
    from stickslip.dynamics.pytrees import Number

MOST_STEPS = 10**7
"""Greatest number of steps of an episode."""


class Timed(Protocol):
    """Protocol of every environment's parameters."""

    @property
    def control_period(self) -> Number:
        """Duration of a step [s]."""
        ...

    @property
    def time_limit(self) -> Number:
        """Duration of an episode [s]."""
        ...


def horizon(params: Timed) -> int:
    """Control steps to the time limit. params: concrete numbers."""
    steps = np.asarray(params.time_limit, float) / np.asarray(params.control_period, float)
    count = float(np.max(steps))
    if not count <= MOST_STEPS:
        raise ValueError(
            f"time_limit = {shown(params.time_limit)} with control_period = "
            f"{shown(params.control_period)} makes {count:.3g} steps; accepted: at most "
            f"{MOST_STEPS:g}"
        )
    return max(1, int(np.ceil(count - 0.5)))


Rule: TypeAlias = Mapping[str, Any]
"""Keywords of `require_number`; a number may be None where "accepted" begins with it."""
POSITIVE: Rule = {"low": 0.0, "strict": True, "accepted": "finite, > 0"}
NON_NEGATIVE: Rule = {"low": 0.0, "accepted": "finite, >= 0"}


def as_numbers(given: Mapping[str, Any], rules: Mapping[str, Rule]) -> dict[str, Any]:
    """The entries with numbers as pytrees hold them; ValueError naming a bad one."""
    return {
        name: value if _is_none(name, value, rules) else as_number(name, value, **rules[name])
        for name, value in given.items()
    }


def require_numbers(params: Any, rules: Mapping[str, Rule], dtype: Any) -> None:
    """Raise ValueError unless the parameters that the rules name keep them and broadcast."""
    numbers = {name: getattr(params, name) for name in rules}
    numbers = {name: one for name, one in numbers.items() if not _is_none(name, one, rules)}
    require_numeric(**numbers)
    for name, value in numbers.items():
        require_number(name, value, **rules[name], dtype=dtype)
    require_broadcast(**numbers)


def _is_none(name: str, value: object, rules: Mapping[str, Rule]) -> bool:
    """True for None where it is accepted, and for entries without a rule."""
    return name not in rules or (value is None and rules[name]["accepted"].startswith("None"))


Range = tuple[Numeric, Numeric]


def require_range(
    name: str,
    given: Any,
    low: float = -np.inf,
    strict: bool = False,
    optional: bool = True,
    high: float = np.inf,
) -> None:
    """Raise ValueError unless `given` is (low, high), finite and in order, or None if optional."""
    if given is None and optional:
        return
    accepted = f"(low, high), finite, low <= high, low {'>' if strict else '>='} {low}"
    accepted += f", high <= {high}" if high < np.inf else ""
    if not isinstance(given, tuple) or len(given) != 2:
        raise ValueError(f"{name} = {shown(given)} is no range; accepted: {accepted}")
    for end in given:
        require_number(name, end, low=low, high=high, strict=strict, accepted=accepted)
        require_numeric(**{name: end})
    require_broadcast(**{f"{name}[0]": given[0], f"{name}[1]": given[1]})
    if is_concrete(given) and np.any(np.asarray(given[0]) > np.asarray(given[1])):
        raise ValueError(f"{name} = {shown(given)} has low > high; accepted: {accepted}")
