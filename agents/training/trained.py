"""What comes of training."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from pathlib import Path


class Trained(NamedTuple):
    """What came of a call of `train`."""

    directory: Path
    policy: Path
    """The policy of the best evaluation."""
    config: Any
    """The machine's configuration."""
    timesteps: int
    seconds: float
    """Trained in all, over every resumption [s]."""
    finished: bool

    @property
    def percent(self) -> int:
        """How much of the training is done, 100 at its end only."""
        return min(100 * self.timesteps // self.config.timesteps, 100)

    @property
    def name(self) -> str:
        """What to call the policy: one that is not trained to the end says so."""
        if self.finished:
            return "trained policy"
        return f"policy after {self.percent} % of its training"
