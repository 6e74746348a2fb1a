"""Gymnasium environments over a functional one, a single one and a vector in one compiled call."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from stickslip.dynamics.checks import (
    require_choice,
    require_integer,
    require_kind,
    require_known,
    shown,
)
from stickslip.envs.adapters.base import RENDER_MODE, Compiled, require_autoreset
from stickslip.envs.adapters.packed import MOST_SEED, Results, ending

if TYPE_CHECKING:
    from stickslip.envs.functional import FunctionalEnv

SEEDS = f"None, an integer from 0 to {MOST_SEED}, or a list of such, one an environment"


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
        if seed is not None:
            seed = require_integer("seed", seed, low=0, high=MOST_SEED)
        super().reset(seed=seed)
        if seed is not None or not self._seeded:
            self._envs.seed([int(self.np_random.integers(2**31)) if seed is None else seed])
            self._seeded = True
        obs = self._envs.reset(params=params)[0].astype(np.float32)
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


class GymVectorEnv(Compiled, VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """n functional environments as a gymnasium VectorEnv, behaving like SyncVectorEnv.

    Environment i of `reset(seed=s)` is the single environment of seed s + i, episode after episode.
    autoreset_mode: every AutoresetMode; with SAME_STEP infos hold `final_obs` and `final_info`;
    with DISABLED finished environments are reset by `reset(options={"reset_mask": mask})` before
    the next step. info entries are arrays [n] with their masks under `_name`.
    """

    def __init__(
        self,
        env: FunctionalEnv,
        params: Any,
        num_envs: int,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
    ):
        known = {name: mode for mode in AutoresetMode for name in (mode.name.lower(), mode.value)}
        if not isinstance(autoreset_mode, AutoresetMode):
            require_choice("autoreset_mode", autoreset_mode, tuple(known), also="an AutoresetMode")
            autoreset_mode = known[autoreset_mode]
        self.autoreset_mode = autoreset_mode
        self._compile(env, params, num_envs, render_mode, autoreset=autoreset_mode.name.lower())
        self.num_envs = self._envs.num_envs
        self.single_observation_space, self.single_action_space = self._spaces()
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {
            "render_modes": [RENDER_MODE],
            "render_fps": self._frame_rate(),
            "autoreset_mode": self.autoreset_mode,
        }
        self._seeded = False
        self._obs: np.ndarray | None = None

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin episodes everywhere, or where options["reset_mask"] is true.

        Other options are those of the single environment, for the episodes that begin here.
        """
        given = options
        if isinstance(options, Mapping):
            given = {name: value for name, value in options.items() if name != "reset_mask"}
            require_known(given, ("reset_mask", *self.functional.option_names), "option of reset")
        params, mask = self._episode_params(given), (options or {}).get("reset_mask")
        if mask is not None:
            mask = np.asarray(mask)
            if mask.shape != (self.num_envs,) or mask.dtype != bool or not mask.any():
                raise ValueError(
                    f"reset_mask of shape {mask.shape} and type {mask.dtype}; accepted: booleans "
                    f"[{self.num_envs}], at least one true"
                )
        self._seed(seed, mask)
        obs = self._envs.reset(mask, params).astype(np.float32)
        if mask is not None and self._obs is not None:
            obs = np.where(mask[:, None], obs, self._obs)
        self._obs = obs.copy()
        return obs, {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One control step of every environment. Raises ValueError for bad actions, and for
        stepping a finished environment when autoreset is disabled."""
        last = self._envs.last
        if self.autoreset_mode is AutoresetMode.DISABLED and last is not None:
            over = (last.terminated | last.truncated) & ~last.autoreset
            if ended := np.flatnonzero(over).tolist():
                first = ending(last.info_of(ended[0]), bool(last.terminated[ended[0]]))
                raise ValueError(
                    f"environments {shown(ended)} of {self.num_envs} have ended (the first: "
                    f'{first}); accepted: reset(options={{"reset_mask": mask}}) first, as '
                    "autoreset is disabled"
                )
        results = self._envs.step(self._checked(actions, (self.num_envs,)))
        infos, obs = self._gather_infos(results), results.obs
        self._obs = obs.copy()
        reward = results.reward.astype(np.float64)
        return obs, reward, results.terminated, results.truncated, infos

    def render(self) -> tuple[np.ndarray, "..."] | None:
        """One picture [height, width, 3] for each environment, with render_mode "rgb_array"."""
        if self.render_mode is None:
            return None
        return self._every_picture()

    def _gather_infos(self, results: Results) -> dict[str, Any]:
        """Arrays with masks, as SyncVectorEnv gathers them from single environments."""
        infos: dict[str, Any] = {}
        running = ~results.autoreset
        if self.autoreset_mode is AutoresetMode.SAME_STEP and results.autoreset.any():
            over = results.autoreset
            final_obs = np.full(self.num_envs, None, object)
            for i in np.flatnonzero(over):
                final_obs[i] = results.final_obs[i]
            infos |= {"final_obs": final_obs, "_final_obs": over.copy()}
            infos |= {"final_info": _masked(results.info, over), "_final_info": over.copy()}
        return infos | _masked(results.info, running) if running.any() else infos

    def _seed(self, seed: int | list[int | None] | None, mask: np.ndarray | None) -> None:
        if isinstance(seed, int | np.integer):
            super().reset(seed=int(seed))
            seed = [int(seed) + i for i in range(self.num_envs)]
        seeds = [None] * self.num_envs if seed is None else seed
        require_kind("seed", seeds, (list, tuple, np.ndarray), SEEDS)
        if len(seeds) != self.num_envs:
            raise ValueError(f"{len(seeds)} seeds; accepted: {self.num_envs}, one an environment")
        wanted = np.ones(self.num_envs, bool) if mask is None else mask
        rule: dict[str, Any] = {"low": 0, "high": MOST_SEED, "accepted": SEEDS}
        given: list[int | None] = [
            None if one is None else require_integer("seed", one, **rule) for one in seeds
        ]
        given = [one if chosen else None for one, chosen in zip(given, wanted, strict=True)]
        if not self._seeded:
            drawn = self.np_random.integers(2**31, size=self.num_envs).tolist()
            given = [new if one is None else one for one, new in zip(given, drawn, strict=True)]
            self._seeded = True
        if any(one is not None for one in given):
            self._envs.seed(given)


def _masked(columns: dict[str, np.ndarray], mask: np.ndarray) -> dict[str, np.ndarray]:
    """Each column, zero outside the mask, with the mask under its name."""
    masked: dict[str, np.ndarray] = {}
    for name, column in columns.items():
        masked[name] = column if mask.all() else np.where(mask, column, np.zeros_like(column))
        masked[f"_{name}"] = mask.copy()
    return masked
