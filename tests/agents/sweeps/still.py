"""The mass where a reset draws nothing."""

from dataclasses import dataclass

from stickslip.dynamics.pytrees import register_pytree
from tests.agents.mass import MassEnv, MassParams


@register_pytree
@dataclass(frozen=True)
class StillParams(MassParams):
    """Says so."""

    randomisation: None = None


@dataclass(frozen=True)
class StillEnv(MassEnv):
    """The environment that has them."""

    params_kind = StillParams

    @property
    def default_params(self):
        return StillParams(time_limit=0.5)


STILL = (MassEnv(), StillParams(time_limit=0.5))
