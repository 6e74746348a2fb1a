"""The best that can be earned in an environment, by dynamic programming on its own step."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.optimum.file import load_value_policy, save_value_policy
    from stickslip.agents.optimum.grid import Axis, Grid, Place, Sheet
    from stickslip.agents.optimum.policy import Ahead, StateMap, ValuePolicy
    from stickslip.agents.optimum.solution import Known, Replay, Solution, known, replay, solve
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "file": ("load_value_policy", "save_value_policy"),
            "grid": ("Axis", "Grid", "Place", "Sheet"),
            "policy": ("Ahead", "StateMap", "ValuePolicy"),
            "solution": ("Known", "Replay", "Solution", "known", "replay", "solve"),
        },
    )

__all__ = [
    "Ahead",
    "Axis",
    "Grid",
    "Known",
    "Place",
    "Replay",
    "Sheet",
    "Solution",
    "StateMap",
    "ValuePolicy",
    "known",
    "load_value_policy",
    "replay",
    "save_value_policy",
    "solve",
]
