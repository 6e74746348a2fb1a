"""Sweeps of the mass, which compiles quickly."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from stickslip.agents import sweep
from stickslip.dynamics.pytrees import register_pytree
from tests.agents.mass import MassEnv, MassParams, Pull

TASK = (MassEnv(), MassParams(time_limit=1.0))
WHO = {"pull": Pull(), "hard": Pull(4.0)}
AXES = {"mu": "0.02:0.3:5", "task.mass": "0.5:3:3", "mu_patch": "0.01:0.1:2:log"}
CELL = 40


def swept(out: Path, **changes: Any):
    """2 policies at 5 x 6 points with 7 episodes each: 420 episodes in 12 cells."""
    how: dict[str, Any] = {"task": TASK, "axes": AXES, "episodes": 7, "cell": CELL} | changes
    return sweep(policies=WHO, out=out, **how)


@register_pytree
@dataclass(frozen=True)
class StillParams(MassParams):
    """The mass where a reset draws nothing."""

    randomisation: None = None


@dataclass(frozen=True)
class StillEnv(MassEnv):
    """The environment that has them."""

    params_kind = StillParams

    @property
    def default_params(self):
        return StillParams(time_limit=0.5)
