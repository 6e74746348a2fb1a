"""Protocol of parameters with a time limit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from stickslip.dynamics.plain_checks import shown

if TYPE_CHECKING:
    from stickslip.dynamics.numeric import Number

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
    import numpy as np

    steps = np.asarray(params.time_limit, float) / np.asarray(params.control_period, float)
    count = float(np.max(steps))
    if not count <= MOST_STEPS:
        raise ValueError(
            f"time_limit = {shown(params.time_limit)} with control_period = "
            f"{shown(params.control_period)} makes {count:.3g} steps; accepted: at most "
            f"{MOST_STEPS:g}"
        )
    return max(1, int(np.ceil(count - 0.5)))
