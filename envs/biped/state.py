"""Where an episode of the biped's is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import jax

from stickslip.dynamics.biped import BipedState
from stickslip.envs.biped.draw import Drawn

if TYPE_CHECKING:
    from jaxtyping import Array, Bool, Float, Int


class Totals(NamedTuple):
    """Sums over the episode."""

    reward: Float[Array, ""]
    turned: Float[Array, ""]
    """Crank angle [rad]."""
    walked: Float[Array, ""]
    """[m]"""
    slid: Float[Array, ""]
    """[m]"""
    energy: Float[Array, ""]
    """Positive motor work and copper loss [J]."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BipedEnvState:
    """Where an episode is. over: it has ended. mode: 0 sticks, +1 / -1 slides."""

    biped: BipedState
    mode: Int[Array, ""]
    elapsed: Int[Array, ""]
    """Control steps so far."""
    over: Bool[Array, ""]
    drawn: Drawn
    totals: Totals
