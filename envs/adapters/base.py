"""Base of the adapters: compiled-in parameters, spaces, and a renderer for each environment."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic

import jax
import numpy as np
from gymnasium import spaces

from stickslip.dynamics import checks
from stickslip.envs.adapters.packed import MOST_ENVS, PackedEnvs
from stickslip.envs.functional import FunctionalEnv, Params, State, horizon

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec


RENDER_MODE = "rgb_array"


class Compiled(Generic[State, Params]):
    """An adapter with the environment and the parameters that its step was compiled with."""

    _functional: FunctionalEnv[State, Params]
    _params: Params
    _spec: EnvSpec | None = None
    render_mode: str | None

    def _compile(
        self,
        env: FunctionalEnv[State, Params],
        params: Any,
        num_envs: int,
        render_mode: str | None,
        autoreset: str | None = None,
    ) -> None:
        """Check what every adapter is given, and make its batch. autoreset: set, if not None."""
        checks.require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
        env.check_params(params)
        num_envs = checks.require_integer("num_envs", num_envs, high=MOST_ENVS)
        if render_mode is not None:
            checks.require_choice("render_mode", render_mode, (RENDER_MODE,), also="None")
        env = env if autoreset is None else replace(env, autoreset=autoreset)  # type: ignore[type-var]
        self._functional, self._params, self.render_mode = env, params, render_mode
        self._envs = PackedEnvs(env, params, num_envs)

    def _set_spec(self, spec: EnvSpec | None) -> None:
        params: Any = self._params
        with suppress(ValueError):  # an episode without end
            spec = spec and replace(spec, max_episode_steps=horizon(params))
        self._spec = spec

    spec: Any = property(lambda self: self._spec, _set_spec)
    """EnvSpec of Gymnasium's `make` or `make_vec`, or None; max_episode_steps by the parameters."""

    @property
    def functional(self) -> FunctionalEnv[State, Params]:
        """The functional environment."""
        return self._functional

    @property
    def params(self) -> Params:
        """Its parameters; fixed, as they are compiled in: make another environment for others."""
        return self._params

    @property
    def cost_limit(self) -> float | None:
        """Most that an episode is to cost in the mean, the sum of info["cost"]; None: no limit."""
        limit = getattr(self._params, "cost_limit", None)
        return None if limit is None else float(limit)

    def _spaces(self) -> tuple[spaces.Box, spaces.Box]:
        """The box of the observation's bounds, and [-1, 1] for every action; float32."""
        low, high = self.functional.observation_bounds(self.params)
        seen = spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)
        return seen, spaces.Box(-1.0, 1.0, (len(self.functional.action_names),), np.float32)

    def _frame_rate(self) -> int:
        """Control steps a second."""
        params: Any = self.params
        return max(1, round(1 / float(params.control_period)))

    def _picture(self, index: int, info: Mapping[str, Any]) -> np.ndarray:
        """[height, width, 3] of an environment; info: of the step before, {} after a reset.

        ValueError without an episode.
        """
        if not self._envs.begun:
            raise ValueError("render without an episode; accepted: after reset()")
        state = self._envs.state_of(index)
        states, infos = jax.tree.map(lambda leaf: np.asarray(leaf)[None], (state, dict(info)))
        return self.functional.pictures(states, infos, self.params)(0)

    def _every_picture(self) -> tuple[np.ndarray, ...]:
        """A picture of each environment."""
        last = self._envs.last
        return tuple(
            self._picture(i, {} if last is None or last.autoreset[i] else last.info_of(i))
            for i in range(self._envs.num_envs)
        )

    def _checked(self, actions: Any, batch: tuple[int, ...] = ()) -> np.ndarray:
        """The actions, saturated; ValueError for bad ones and without an episode."""
        if not self._envs.begun:
            raise ValueError("step without an episode; accepted: after reset()")
        checks.require_precision("the environment", self._envs.dtype)
        return np.asarray(self.functional.check_action(actions, batch), self._envs.dtype)

    def _episode_params(self, options: Mapping[str, Any] | None) -> Params | None:
        """The parameters of a start that options ask for; None where they ask for nothing."""
        checks.require_precision("the environment", self._envs.dtype)
        if options is None:
            return None
        checks.require_kind("options", options, Mapping, "None or a dict")
        return self.functional.episode_params(self.params, options) if options else None


def require_autoreset(env: FunctionalEnv, wanted: str, why: str) -> None:
    """ValueError for an environment that resets in another way than the library expects."""
    checks.require_kind("env", env, FunctionalEnv, "a BipedEnv or UGVEnv")
    checks.require_that(env.autoreset == wanted, "autoreset", env.autoreset, f"{wanted!r}, {why}")
