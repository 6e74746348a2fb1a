"""Pictures of every environment of a batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from stickslip.envs.adapters.packed import PackedEnvs
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

    def of(self, infos: list[dict[str, Any]]) -> tuple[np.ndarray, ...]:
        """[height, width, 3] of each; infos: of the steps before, {} after a reset."""
        return tuple(self._draw(index, info) for index, info in enumerate(infos))

    def _draw(self, index: int, info: dict[str, Any]) -> np.ndarray:
        own = self._envs.params_of(index)
        params = self._params if own is None else own
        if self._renderers[index] is None or self._drawn[index] is not own:
            self._renderers[index], self._drawn[index] = self._env.renderer(params), own
        state = self._envs.state_of(index)
        return self._renderers[index].draw(self._env.picture(state, info, params))
