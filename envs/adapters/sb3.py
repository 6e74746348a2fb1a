"""A Stable-Baselines3 vector environment over a functional one (extra `sb3`)."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from stickslip.dynamics.checks import require_integer
from stickslip.dynamics.lazily import require
from stickslip.envs.adapters.base import Compiled, require_autoreset
from stickslip.envs.adapters.packed import MOST_SEED

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stable_baselines3.common.monitor import Monitor
    from stable_baselines3.common.vec_env import VecEnv

    from stickslip.envs.functional import FunctionalEnv
else:
    Monitor = require("stable_baselines3.common.monitor", "SB3VecEnv", "sb3").Monitor
    VecEnv = require("stable_baselines3.common.vec_env", "SB3VecEnv", "sb3").VecEnv


class SB3VecEnv(Compiled, VecEnv):
    """n copies of a functional environment, stepped in one compiled call.

    Seeds and episodes are those of the Gymnasium adapters: environment i has seed `seed` + i. At an
    episode's end its info holds `terminal_observation`, `TimeLimit.truncated` (true only where the
    time limit and nothing else ended it), `episode` (return r, length l, wall time t) and the
    functional environment's info of the last step; other infos hold the step's `cost` alone, which
    is what makes stepping cheap. Observations and rewards are fresh, writable float32 arrays.

    `episode` is what SB3's Monitor puts there, so `env_is_wrapped(Monitor)` is true:
    `evaluate_policy` takes its numbers and does not warn, and no Monitor is needed. With
    render_mode "rgb_array", `get_images` gives a picture of each environment and `render` all of
    them in one. `set_options` gives the options of the next reset of all, see GymEnv.reset.

    `get_attr` reaches what this environment has (functional, params, spaces, ...), the entries of
    the parameters and the choices of the functional environment; `env_method` calls the methods of
    the functional environment. Parameters cannot be set, as they are compiled in.
    """

    def __init__(
        self,
        env: FunctionalEnv,
        params: Any,
        num_envs: int,
        seed: int = 0,
        render_mode: str | None = None,
    ):
        require_autoreset(env, "same_step", "as SB3 expects")
        seed = require_integer("seed", seed, low=0, high=MOST_SEED)
        self._compile(env, params, num_envs, render_mode)
        self._actions: np.ndarray | None = None
        self._begun = time.time()
        super().__init__(self._envs.num_envs, *self._spaces())
        self.seed(seed)
        self.metadata = {**self.metadata, "render_fps": self._frame_rate()}

    def reset(self) -> np.ndarray:
        """New episodes everywhere; the first reset, and one after `seed`, starts the key chains."""
        given = self._options
        self._reset_options()  # a bad one is of this reset alone
        if len(given) != self.num_envs:
            raise ValueError(f"{len(given)} options; accepted: {self.num_envs}, or a dict")
        params = self._episode_params(given[0])
        if any(options != given[0] for options in given):
            raise ValueError("options differ; accepted: a dict, for all environments")
        self._envs.seed(self._seeds)
        self._reset_seeds()
        self.reset_infos = [{} for _ in range(self.num_envs)]
        self._begun = time.time()
        return self._envs.reset(params=params).astype(np.float32)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seeds of the environments for the next reset, `seed`, `seed` + 1, ...; None draws one."""
        return super().seed(seed and require_integer("seed", seed, low=0, high=MOST_SEED))

    def step_async(self, actions: np.ndarray) -> None:
        """Check the actions and keep them for `step_wait`."""
        self._actions = self._checked(actions, (self.num_envs,))

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step of every environment."""
        if self._actions is None:
            raise ValueError("step_wait without actions; accepted: after step_async")
        results, self._actions = self._envs.step(self._actions), None
        dones = results.terminated | results.truncated
        costs = results.info.get("cost")
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if costs is not None:
            infos = [{"cost": cost} for cost in costs.tolist()]
        for i in np.flatnonzero(dones):
            last = results.info_of(int(i))
            infos[i] = last | {
                "terminal_observation": results.final_obs[i],
                "TimeLimit.truncated": bool(results.truncated[i] and not results.terminated[i]),
                "episode": {
                    "r": last["episode_return"],
                    "l": last["episode_length"],
                    "t": time.time() - self._begun,
                },
            }
        return results.obs, results.reward.astype(np.float32), dones, infos

    def close(self) -> None:
        """Nothing to release."""

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture [height, width, 3] of each environment; None without render_mode."""
        if self.render_mode is None:
            return [None] * self.num_envs
        return self._every_picture()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute once for each environment asked for: of this one, else of the parameters,
        else of the functional environment. AttributeError for an unknown one."""
        for owner in (self, self.params, self.functional):
            if hasattr(owner, attr_name):
                return self._for_each(getattr(owner, attr_name), indices)
        raise AttributeError(f"no attribute {attr_name!r}; accepted: those of {self._owners()}")

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """ValueError: the parameters are compiled in."""
        accepted = "set_options for an episode, or a new SB3VecEnv with other parameters"
        raise ValueError(f"{attr_name!r} cannot be set; accepted: {accepted}")

    def env_method(
        self, method_name: str, *method_args: object, indices: Any = None, **method_kwargs: object
    ) -> list[Any]:
        """Call a method of the functional environment, once, and return what it gives for each
        environment asked for. AttributeError for an unknown one."""
        method = getattr(self.functional, method_name, None)
        if not callable(method):
            raise AttributeError(f"no method {method_name!r}; accepted: those of {self._owners()}")
        return self._for_each(method(*method_args, **method_kwargs), indices)

    def env_is_wrapped(self, wrapper_class: type, indices: Any = None) -> list[bool]:
        """True for Monitor, whose statistics every episode has; no other wrapper is inside."""
        return self._for_each(wrapper_class is Monitor, indices)

    def _owners(self) -> str:
        return f"SB3VecEnv, {type(self.params).__name__} and {type(self.functional).__name__}"

    def _for_each(self, value: Any, indices: Any) -> list[Any]:
        return [value] * len(list(self._get_indices(indices)))


__all__ = ["SB3VecEnv"]
