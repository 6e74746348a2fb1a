"""Sweeps of the mass, which compiles quickly."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax

from stickslip.agents import sweep
from tests.agents.mass import MassEnv, MassParams, Pull

TASK = (MassEnv(), MassParams(time_limit=1.0))
WHO = {"pull": Pull(), "hard": Pull(4.0)}
AXES = {"mu": "0.02:0.3:5", "task.mass": "0.5:3:3", "mu_patch": "0.01:0.1:2:log"}
CELL = 40


def swept(out: Path, **changes: Any):
    """2 policies at 5 x 6 points with 7 episodes each: 420 episodes in 12 cells."""
    how: dict[str, Any] = {"task": TASK, "axes": AXES, "episodes": 7, "cell": CELL} | changes
    return sweep(policies=WHO, out=out, **how)


@dataclass(frozen=True)
class StillEnv(MassEnv):
    """The mass where a reset draws nothing."""

    def reset_env(self, key, params):
        return super().reset_env(jax.random.key(0), params)
