"""A Stable-Baselines3 vector environment over a functional one (extra `train`)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv

from stickslip.dynamics.checks import require_integer, require_kind
from stickslip.envs.adapters.packed import MOST_ENVS, PackedEnvs
from stickslip.envs.adapters.spaces import action_space, observation_space
from stickslip.envs.functional import FunctionalEnv

if TYPE_CHECKING:
    from collections.abc import Sequence


class SB3VecEnv(VecEnv):
    """n copies of a functional environment, stepped in one compiled call.

    Seeds and episodes are those of the Gymnasium adapters: environment i has seed `seed` + i. At an
    episode's end its info holds `terminal_observation`, `TimeLimit.truncated` (true only where the
    time limit and nothing else ended it), `episode` (return r, length l, wall time t) and the
    functional environment's info of the last step; other infos are empty, which is what makes
    stepping cheap. Observations and rewards are fresh, writable float32 arrays.
    """

    def __init__(self, env: FunctionalEnv, params: Any, num_envs: int, seed: int = 0):
        require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
        if env.autoreset != "same_step":
            raise ValueError(
                f"autoreset = {env.autoreset!r}; accepted: 'same_step', as SB3 expects"
            )
        num_envs = require_integer("num_envs", num_envs, high=MOST_ENVS)
        seed = require_integer("seed", seed, low=0)
        self.render_mode = None
        self._envs = PackedEnvs(env, params, num_envs)
        self._seeds_given: list[int | None] = [seed + i for i in range(num_envs)]
        self._actions: np.ndarray | None = None
        self._begun = time.time()
        super().__init__(num_envs, observation_space(env, params), action_space(env))

    def reset(self) -> np.ndarray:
        """New episodes everywhere; the first reset, and one after `seed`, starts the key chains."""
        if any(seed is not None for seed in self._seeds):
            self._seeds_given = list(self._seeds)
        if any(seed is not None for seed in self._seeds_given):
            self._envs.seed(self._seeds_given)
        self._seeds_given = [None] * self.num_envs
        self._reset_seeds()
        self._reset_options()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._begun = time.time()
        return self._envs.reset().astype(np.float32)

    def step_async(self, actions: np.ndarray) -> None:
        """Check the actions and keep them for `step_wait`."""
        if not self._envs.begun:
            raise ValueError("step without episodes; accepted: after reset()")
        checked = self._envs.env.check_action(actions, (self.num_envs,))
        self._actions = np.asarray(checked, self._envs.dtype)

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step of every environment."""
        if self._actions is None:
            raise ValueError("step_wait without actions; accepted: after step_async")
        results, self._actions = self._envs.step(self._actions), None
        dones = results.terminated | results.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(dones):
            last = {name: column[i].item() for name, column in results.info.items()}
            infos[i] = last | {
                "terminal_observation": results.final_obs[i].astype(np.float32),
                "TimeLimit.truncated": bool(results.truncated[i] and not results.terminated[i]),
                "episode": {
                    "r": last["episode_return"],
                    "l": last["episode_length"],
                    "t": time.time() - self._begun,
                },
            }
        obs, reward = results.obs.astype(np.float32), results.reward.astype(np.float32)
        return obs, reward, dones, infos

    def close(self) -> None:
        """Nothing to release."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """The adapter's own attribute, once for each environment asked for."""
        return [getattr(self, attr_name)] * len(self._chosen(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Not supported: the environments' parameters are immutable."""
        raise ValueError(f"{attr_name!r} cannot be set; accepted: a new SB3VecEnv")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any):
        """Not supported: the environments are functions without methods of their own."""
        raise ValueError(f"{method_name!r} cannot be called; accepted: no environment methods")

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """No wrapper is ever inside."""
        return [False] * len(self._chosen(indices))

    def _chosen(self, indices: Any) -> Sequence[int]:
        return list(self._get_indices(indices))


__all__ = ["SB3VecEnv"]
