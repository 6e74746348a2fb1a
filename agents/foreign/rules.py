"""Rules of the entries of configurations and files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, TypedDict

from stickslip.dynamics.plain_checks import require_choice, require_kind

MOST = 2**53
"""Whole numbers are at most this, where a rule says no less: each of them is a float, too."""


Kind: TypeAlias = type[bool] | type[int] | type[float] | type[str] | Literal["range"]
"""Of a value; "range": two numbers, low <= high."""


class Limits(TypedDict, total=False):
    """Of what a rule accepts; see Rule."""

    low: float
    high: float
    strict: bool
    optional: bool
    choices: tuple[str, ...]


@dataclass(frozen=True)
class Rule:
    """Rule of a field's accepted values."""

    kind: Kind
    about: str
    low: float = -math.inf
    high: float = math.inf
    strict: bool = False
    """The lowest value is itself excluded."""
    optional: bool = False
    choices: tuple[str, ...] = ()

    @property
    def accepted(self) -> str:
        """In words."""
        if self.choices:
            return ", ".join(self.choices)
        if self.kind is bool or self.kind is str:
            return "true or false" if self.kind is bool else "a name"
        words = "an integer" if self.kind is int else "finite"
        words += "" if self.low == -math.inf else f", {'>' if self.strict else '>='} {self.low:g}"
        words += "" if self.high == math.inf else f", <= {self.high:g}"
        words = f"two numbers low <= high, {words}" if self.kind == "range" else words
        return f"{words}, or nothing" if self.optional else words

    def require(self, name: str, value: object) -> Any:
        """The value as a field holds it, or ValueError naming the field, the value and what is
        accepted."""
        if value is None and self.optional:
            return None
        if self.choices:
            require_choice(name, value, self.choices)
        elif self.kind is bool or self.kind is str:
            require_kind(name, value, self.kind, self.accepted)
        elif self.kind is int:
            from stickslip.dynamics.checks import require_integer  # rules are read without JAX

            low, high = int(max(self.low, -MOST)), int(min(self.high, MOST))
            return require_integer(name, value, low=low, high=high, accepted=self.accepted)
        elif self.kind == "range":
            return self._require_range(name, value)
        else:
            return self._require_one(name, value)
        return value

    def _require_one(self, name: str, value: Any) -> float:
        from stickslip.dynamics.checks import require_number

        require_kind(name, value, (int, float), self.accepted)
        require_number(
            name,
            value,
            low=self.low,
            high=self.high,
            strict=self.strict,
            accepted=self.accepted,
        )
        return float(value)

    def _require_range(self, name: str, value: Any) -> tuple[float, float]:
        pair = isinstance(value, tuple | list) and len(value) == 2
        require_kind(name, value, (tuple, list) if pair else (), self.accepted)
        low, high = (self._require_one(name, end) for end in value)
        if low > high:
            raise ValueError(f"{name} = {(low, high)} has low > high; accepted: {self.accepted}")
        return low, high
