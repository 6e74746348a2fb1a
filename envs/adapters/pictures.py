"""Pictures of every environment of a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from stickslip.envs.adapters.packed import PackedEnvs, Results
    from stickslip.envs.functional import FunctionalEnv


class Pictures:
    """A renderer for each environment, made when it is first asked for a picture, and again for
    episodes with parameters of their own."""

    def __init__(self, env: FunctionalEnv, params: Any, envs: PackedEnvs):
        self._env, self._params, self._envs = env, params, envs
        self._renderers: list[Any] = [None] * envs.num_envs
        self._drawn: list[Any] = [None] * envs.num_envs

    def reset(self) -> None:
        """Forget what was drawn before."""
        for renderer in self._renderers:
            if renderer is not None:
                renderer.reset()

    def after(self, results: Results | None) -> tuple[np.ndarray, ...]:
        """[height, width, 3] of each environment; results: of the step before, None after a reset.

        ValueError without episodes.
        """
        if not self._envs.begun:
            raise ValueError("render without episodes; accepted: after reset()")
        infos: list[dict[str, Any]] = [{} for _ in self._renderers]
        if results is not None:
            for i in map(int, np.flatnonzero(~results.autoreset)):
                infos[i] = results.info_of(i)
        return tuple(self._draw(index, info) for index, info in enumerate(infos))

    def _draw(self, index: int, info: dict[str, Any]) -> np.ndarray:
        own = self._envs.params_of(index)
        params = self._params if own is None else own
        if self._renderers[index] is None or self._drawn[index] is not own:
            self._renderers[index], self._drawn[index] = self._env.renderer(params), own
        state = self._envs.state_of(index)
        return self._renderers[index].draw(self._env.picture(state, info, params))
