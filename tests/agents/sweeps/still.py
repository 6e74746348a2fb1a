"""The mass where a reset draws nothing."""

from dataclasses import dataclass

import jax

from tests.agents.mass import MassEnv, MassParams


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StillParams(MassParams):
    """Says so."""

    randomisation: None = None


STILL = (MassEnv(), StillParams(time_limit=0.5))
