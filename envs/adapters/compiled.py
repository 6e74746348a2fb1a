"""What an adapter is compiled from, to be read and not set."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from stickslip.envs.functional import FunctionalEnv


class Compiled:
    """An adapter with the environment and the parameters that its step was compiled with."""

    _functional: FunctionalEnv
    _params: Any

    @property
    def functional(self) -> FunctionalEnv:
        """The functional environment."""
        return self._functional

    @property
    def params(self) -> Any:
        """Its parameters; fixed, as they are compiled in: make another environment for others."""
        return self._params
