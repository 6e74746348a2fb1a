"""Pictures of every environment of a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Generic, Protocol

import numpy as np

from stickslip.envs.functional import Params

if TYPE_CHECKING:
    from stickslip.envs.adapters.packed import PackedEnvs
    from stickslip.envs.adapters.results import Results
    from stickslip.envs.functional import FunctionalEnv


class Renderer(Protocol):
    """What an environment's pictures are drawn by."""

    def reset(self) -> None:
        """Forget what was drawn before."""
        ...

    def draw(self, picture: Any, /) -> np.ndarray:
        """[height, width, 3] of what the environment's `picture` says."""
        ...


class Pictures(Generic[Params]):
    """A renderer for each environment, made when it is first asked for a picture, and again for
    episodes with parameters of their own."""

    def __init__(self, env: FunctionalEnv[Any, Params], params: Params, envs: PackedEnvs):
        self._env, self._params, self._envs = env, params, envs
        self._renderers: list[Renderer | None] = [None] * envs.num_envs
        self._drawn: list[Params | None] = [None] * envs.num_envs

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
        infos: list[dict[str, float]] = [{} for _ in self._renderers]
        if results is not None:
            for i in map(int, np.flatnonzero(~results.autoreset)):
                infos[i] = results.info_of(i)
        return tuple(self._draw(index, info) for index, info in enumerate(infos))

    def _draw(self, index: int, info: dict[str, float]) -> np.ndarray:
        own = self._envs.params_of(index)
        params = self._params if own is None else own
        renderer = self._renderers[index]
        if renderer is None or self._drawn[index] is not own:
            self._renderers[index] = renderer = self._env.renderer(params)
            self._drawn[index] = own
        state = self._envs.state_of(index)
        return renderer.draw(self._env.picture(state, info, params))
