"""State of a biped episode."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from stickslip.dynamics.biped import BipedState
from stickslip.dynamics.pytrees import register_pytree
from stickslip.envs.biped.draw import Drawn

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int


class StepOutcome(NamedTuple):
    """Outcome of one control step."""

    turned: Float[Array, ""]
    """Crank angle [rad]."""
    walked: Float[Array, ""]
    """Distance of the centre of mass [m]."""
    slid: Float[Array, ""]
    """[m]"""
    positive_work: Float[Array, ""]
    """[J]"""
    copper_loss: Float[Array, ""]
    """[J]"""

    @property
    def energy(self) -> Float[Array, ""]:
        """Positive motor work and copper loss [J]."""
        return self.positive_work + self.copper_loss

    def info(self, period: Float[Array, ""]) -> dict[str, Array]:
        """Entries of info."""
        return {
            "walking_speed": self.walked / period,
            "walked": self.walked,
            "slid": self.slid,
            "positive_work": self.positive_work,
            "copper_loss": self.copper_loss,
        }


class Totals(NamedTuple):
    """Sums over the episode, or what a step adds to them."""

    reward: Float[Array, ""]
    turned: Float[Array, ""]
    """Crank angle [rad]."""
    walked: Float[Array, ""]
    """[m]"""
    slid: Float[Array, ""]
    """[m]"""
    energy: Float[Array, ""]
    """Positive motor work and copper loss [J]."""

    def info(self, elapsed: Int[Array, ""], duration: Float[Array, ""]) -> dict[str, Array]:
        """Entries of info about the episode after so many steps and seconds."""
        return {
            "episode_return": self.reward,
            "episode_length": elapsed,
            "episode_walked": self.walked,
            "episode_slid": self.slid,
            "episode_energy": self.energy,
            "episode_mean_rate": self.turned / duration,
        }


@register_pytree
@dataclass(frozen=True)
class BipedEnvState:
    """State of an episode. over: it has ended. mode: 0 sticks, +1 / -1 slides."""

    biped: BipedState
    mode: Int[Array, ""]
    elapsed: Int[Array, ""]
    """Control steps so far."""
    over: Bool[Array, ""]
    drawn: Drawn
    totals: Totals
    rests: Totals
    """Rounding errors of the totals (see `compensated`)."""

    @property
    def to_go(self) -> Float[Array, ""] | None:
        """Distance of the mark ahead of the centre of mass [m]; None without a mark."""
        return None if self.drawn.mark is None else self.drawn.mark - self.totals.walked
