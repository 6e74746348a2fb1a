"""A Gymnasium environment over a functional one; no physics here."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from stickslip.dynamics.checks import require_choice, require_kind
from stickslip.envs.adapters.base import Compiled, Pictures, action_space, observation_space
from stickslip.envs.adapters.packed import PackedEnvs
from stickslip.envs.adapters.results import ending
from stickslip.envs.functional import FunctionalEnv
from stickslip.envs.rendering import Window

RENDER_MODES = ("human", "rgb_array")


class GymEnv(Compiled, gymnasium.Env[np.ndarray, np.ndarray]):
    """One functional environment as a gymnasium.Env.

    `reset(seed=s)` starts the chain of episodes of seed s, the same in every adapter; a reset
    without a seed goes on in the chain. info holds Python numbers under the functional
    environment's names. Rendering needs the extra `viz` and neither a display nor GL.
    """

    metadata = {"render_modes": list(RENDER_MODES), "render_fps": 50}  # noqa: RUF012

    def __init__(self, env: FunctionalEnv, params: Any, render_mode: str | None = None):
        require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
        if env.autoreset != "disabled":
            raise ValueError(
                f"autoreset = {env.autoreset!r}; accepted: 'disabled', a gymnasium.Env is reset "
                "by its user"
            )
        if render_mode is not None:
            require_choice("render_mode", render_mode, RENDER_MODES, also="None")
        self._functional, self._params, self.render_mode = env, params, render_mode
        self.observation_space = observation_space(env, params)
        self.action_space = action_space(env)
        fps = max(1, round(1 / float(params.control_period)))
        self.metadata = self.metadata | {"render_fps": fps}
        self._envs = PackedEnvs(env, params, 1)
        self._seeded = False
        self._ending: str | None = None
        self._info: dict[str, Any] = {}
        self._pictures = Pictures(env, params, self._envs)
        self._window: Window | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Without the window: a copy opens its own."""
        return vars(self) | {"_window": None}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode. options: what is different in this episode alone; see `help` of the
        functional environment's class for their names. ValueError for unknown names and values.

        How an episode starts is a number: other ones compile nothing but, once, the reset. A scene
        or a track compiles a step the first time that its kind is asked for (seconds), and nothing
        for other numbers of that kind.
        """
        params = self._episode_params(options)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self._envs.seed([int(self.np_random.integers(2**31)) if seed is None else seed])
            self._seeded = True
        obs = self._envs.reset(params=params)[0].astype(np.float32)
        self._ending, self._info = None, {}
        self._pictures.reset()
        if self.render_mode == "human":
            self.render()
        return obs, {}

    def step(self, action: Any) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One control step. Raises ValueError for a bad action and after an episode's end."""
        if not self._envs.begun:
            raise ValueError("step without an episode; accepted: after reset()")
        if self._ending is not None:
            raise ValueError(f"the episode has ended ({self._ending}); accepted: reset() first")
        action = np.asarray(self.functional.check_action(action), self._envs.dtype)
        row = self._envs.rows(action[None])[0]
        obs, reward, terminated, truncated, self._info = self._envs.columns.one(row)
        if terminated or truncated:
            self._ending = ending(self._info, terminated)
        if self.render_mode == "human":
            self.render()
        return obs, reward, terminated, truncated, dict(self._info)

    def render(self) -> np.ndarray | None:
        """The picture [height, width, 3] for "rgb_array"; shown in a window for "human"."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() without render_mode; accepted: 'human', 'rgb_array'")
            return None
        picture = self._pictures.of_one(0, self._info)
        if self.render_mode == "rgb_array":
            return picture
        if self._window is None:
            self._window = Window(fps=self.metadata["render_fps"])
        self._window.show(picture)
        return None

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None
