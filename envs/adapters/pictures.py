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
    """Protocol of an environment's renderer."""

    def reset(self) -> None:
        """Forget what was drawn before."""
        ...

    def draw(self, picture: Any, /) -> np.ndarray:
        """[height, width, 3] of what the environment's `picture` says."""
        ...


class Pictures(Generic[Params]):
    """A renderer for each environment, made when it is first asked for a picture, and again for
    episodes with parameters of their own. A copy makes its own."""

    def __init__(self, env: FunctionalEnv[Any, Params], params: Params, envs: PackedEnvs):
        self._env, self._params, self._envs = env, params, envs
        self._renderers: dict[int, tuple[Params | None, Renderer]] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Without the renderers, which hold a canvas that cannot be copied."""
        return vars(self) | {"_renderers": {}}

    def reset(self) -> None:
        """Forget what was drawn before."""
        for _, renderer in self._renderers.values():
            renderer.reset()

    def after(self, results: Results | None) -> tuple[np.ndarray, ...]:
        """[height, width, 3] of each environment; results: of the step before, None after a reset.

        ValueError without episodes.
        """
        infos: list[dict[str, float]] = [{} for _ in range(self._envs.num_envs)]
        if results is not None:
            for i in map(int, np.flatnonzero(~results.autoreset)):
                infos[i] = results.info_of(i)
        return tuple(self.of_one(index, info) for index, info in enumerate(infos))

    def of_one(self, index: int, info: dict[str, Any]) -> np.ndarray:
        """[height, width, 3] of an environment; info: of the step before, {} after a reset."""
        if not self._envs.begun:
            raise ValueError("render without an episode; accepted: after reset()")
        own = self._envs.params_of(index)
        params = self._params if own is None else own
        if index not in self._renderers or self._renderers[index][0] is not own:
            self._renderers[index] = own, self._env.renderer(params)
        state = self._envs.state_of(index)
        return self._renderers[index][1].draw(self._env.picture(state, info, params))
