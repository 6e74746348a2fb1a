"""Amplification of a small difference at the start of the biped's episodes."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from stickslip.agents.evaluation.rollout import play
from stickslip.dynamics.biped import own_time
from stickslip.dynamics.biped.walk_check import nudged, separation
from stickslip.dynamics.status import Status
from stickslip.envs.biped.env import BipedEnv

if TYPE_CHECKING:
    from collections.abc import Sequence

    from jaxtyping import Array, Bool, Float, Key

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.protocol import Player
    from stickslip.dynamics.biped import BipedState
    from stickslip.envs.biped.params import BipedEnvParams
    from stickslip.envs.biped.state import BipedEnvState


@dataclass(frozen=True)
class Beside(BipedEnv):
    """A BipedEnv whose episodes begin a small distance from where they would (`nudged`)."""

    def reset_env(
        self, key: Key[Array, ""], params: BipedEnvParams
    ) -> tuple[Float[Array, " obs"], BipedEnvState]:
        """See FunctionalEnv."""
        _, state = super().reset_env(key, params)
        robot = params.robot.params
        biped = nudged(state.biped, robot.crank, own_time(robot))
        biped = biped.astype(state.biped.crank_rate.dtype)
        state = replace(state, biped=biped)
        return self._observe(state, params), state


def _walk_of(
    played: Rollout[BipedEnvState], params: BipedEnvParams
) -> tuple[BipedState, Bool[Array, " n"]]:
    """States of an episode after each step [n], and whether they are inside the model."""
    del params
    return played.state.biped, played.info["status"] <= Status.SLIP_ONSET


def amplifications(
    env: BipedEnv,
    player: Player[BipedEnvState, BipedEnvParams],
    params: BipedEnvParams,
    seeds: Sequence[int],
) -> Float[np.ndarray, " episodes"]:
    """Growth factor of a small difference of the start in each seed's episode [-].

    The largest distance of two episodes whose starts are NUDGE apart, while both are inside the
    model, over NUDGE; the controller acts in both, a planned path is followed in both.
    """
    given = {one.name: getattr(env, one.name) for one in fields(BipedEnv)}
    (one, inside), (other, inside_beside) = (
        play(kind(**given), player, params, seeds, _walk_of) for kind in (BipedEnv, Beside)
    )
    growth = separation(one, other, np.asarray(params.robot.params.crank))
    return np.max(np.where(inside & inside_beside, growth, 0.0), axis=-1)
