"""From a return to a score: 0 is a trivial policy, 1 the best that is known."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Scale:
    """The two returns that a task's scores lie between. ValueError unless zero < one."""

    zero: float
    one: float

    def __post_init__(self):
        if not self.zero < self.one:
            raise ValueError(
                f"zero = {self.zero}, one = {self.one}; accepted: finite returns, zero < one"
            )

    def score(self, earned: float) -> float:
        """(earned - zero) / (one - zero); above 1 where more is earned than was known."""
        return (earned - self.zero) / (self.one - self.zero)

    def gap(self, earned: float) -> float:
        """What is missing to the best known, in the return's unit; negative above it."""
        return self.one - earned
