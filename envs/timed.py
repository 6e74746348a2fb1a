"""What the parameters of an environment with a time limit hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from stickslip.dynamics.numeric import Number


class Timed(Protocol):
    """What the parameters of every environment hold."""

    @property
    def control_period(self) -> Number:
        """Of a step [s]."""
        ...

    @property
    def time_limit(self) -> Number:
        """Of an episode [s]."""
        ...
