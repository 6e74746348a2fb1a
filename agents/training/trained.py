"""Result of training."""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, NamedTuple, TypeVar

if TYPE_CHECKING:
    from pathlib import Path

    from stickslip.agents.training.configuration import Configuration

Config_co = TypeVar("Config_co", bound="Configuration", covariant=True)


class Trained(NamedTuple, Generic[Config_co]):
    """Result of a call of `train`."""

    directory: Path
    policy: Path
    """The policy of the best evaluation."""
    config: Config_co
    """The machine's configuration."""
    timesteps: int
    seconds: float
    """Trained in all, over every resumption [s]."""
    finished: bool

    @property
    def percent(self) -> int:
        """Percentage of the training that is done, 100 at its end only."""
        return min(100 * self.timesteps // self.config.timesteps, 100)

    @property
    def name(self) -> str:
        """Name of the policy, which says if it is not trained to the end."""
        if self.finished:
            return "trained policy"
        return f"policy after {self.percent} % of its training"
