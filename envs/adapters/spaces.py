"""Gymnasium spaces of a functional environment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from gymnasium import spaces

if TYPE_CHECKING:
    from stickslip.envs.functional import FunctionalEnv, Params, State


def observation_space(env: FunctionalEnv[State, Params], params: Params) -> spaces.Box:
    """The box of the observation's bounds, float32."""
    env.check_params(params)
    low, high = env.observation_bounds(params)
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def action_space(env: FunctionalEnv) -> spaces.Box:
    """[-1, 1] for every action."""
    return spaces.Box(-1.0, 1.0, (len(env.action_names),), np.float32)
