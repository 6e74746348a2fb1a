"""Read-only parameters from which an adapter is compiled."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Generic

import numpy as np

from stickslip.dynamics.checks import require_kind, shown
from stickslip.envs.functional import Params, State
from stickslip.envs.timed import horizon

if TYPE_CHECKING:
    from gymnasium.envs.registration import EnvSpec

    from stickslip.envs.functional import FunctionalEnv


class Compiled(Generic[State, Params]):
    """An adapter with the environment and the parameters that its step was compiled with."""

    _functional: FunctionalEnv[State, Params]
    _params: Params
    _spec: EnvSpec | None = None

    def _set_spec(self, spec: EnvSpec | None) -> None:
        params: Any = self._params
        with suppress(ValueError):  # an episode without end
            spec = spec and replace(spec, max_episode_steps=horizon(params))
        self._spec = spec

    spec: Any = property(lambda self: self._spec, _set_spec)
    """Gymnasium's EnvSpec, where its `make` or `make_vec` made this, else None; max_episode_steps
    is that of the parameters."""

    @property
    def functional(self) -> FunctionalEnv[State, Params]:
        """The functional environment."""
        return self._functional

    @property
    def params(self) -> Params:
        """Its parameters; fixed, as they are compiled in: make another environment for others."""
        return self._params

    def _episode_params(self, options: Mapping[str, Any] | None) -> Params | None:
        """The parameters that the options of a reset ask for; None where they ask for nothing."""
        if options is None:
            return None
        require_kind("options", options, Mapping, "None or a dict")
        if not options:
            return None
        params = self.functional.episode_params(self.params, options)
        bounds = (self.functional.observation_bounds(each) for each in (self.params, params))
        if not all(map(np.array_equal, *bounds)):
            raise ValueError(
                f"options = {shown(dict(options))} would change what is observed; accepted: a "
                "scene or track that leaves the observation as it is"
            )
        return params
