"""A Gymnasium environment over a functional one; no physics here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np

from stickslip.envs.adapters.base import RENDER_MODE, Compiled, require_autoreset
from stickslip.envs.adapters.packed import ending

if TYPE_CHECKING:
    from stickslip.envs.functional import FunctionalEnv


class GymEnv(Compiled, gymnasium.Env[np.ndarray, np.ndarray]):
    """One functional environment as a gymnasium.Env.

    `reset(seed=s)` starts the chain of episodes of seed s, the same in every adapter; a reset
    without a seed goes on in the chain. info holds Python numbers under the functional
    environment's names. Rendering needs the extra `viz` and neither a display nor GL; with
    `gymnasium.make(id, render_mode="human")` Gymnasium's `HumanRendering` shows it in a window.
    """

    metadata = {"render_modes": [RENDER_MODE], "render_fps": 50}  # noqa: RUF012

    def __init__(self, env: FunctionalEnv, params: Any, render_mode: str | None = None):
        require_autoreset(env, "disabled", "a gymnasium.Env is reset by its user")
        self._compile(env, params, 1, render_mode)
        self.observation_space, self.action_space = self._spaces()
        self.metadata = self.metadata | {"render_fps": self._frame_rate()}
        self._seeded = False
        self._ending: str | None = None
        self._info: dict[str, Any] = {}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode. options: how this episode starts; see `help` of the functional
        environment's class for their names. ValueError for unknown names and values. Options
        compile a reset the first time, and other numbers nothing.
        """
        params = self._episode_params(options)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self._envs.seed([int(self.np_random.integers(2**31)) if seed is None else seed])
            self._seeded = True
        obs = self._envs.reset((np.ones(1, bool), params))[0].astype(np.float32)
        self._ending, self._info = None, {}
        return obs, {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One control step. Raises ValueError for a bad action and after an episode's end."""
        if self._ending is not None:
            raise ValueError(f"the episode has ended ({self._ending}); accepted: reset() first")
        row = self._envs.rows(self._checked(action)[None])[0]
        columns = self._envs.columns
        reward, terminated, truncated = row[columns.flags - 1 : columns.flags + 2].tolist()
        terminated, truncated = terminated != 0, truncated != 0
        self._info = columns.info_of(row)
        if terminated or truncated:
            self._ending = ending(self._info, terminated)
        obs = row[: columns.width].astype(np.float32)
        return obs, reward, terminated, truncated, dict(self._info)

    def render(self) -> np.ndarray | None:
        """The picture [height, width, 3], with render_mode "rgb_array"."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without render_mode; accepted: 'rgb_array'")
            return None
        return self._picture(0, self._info)
