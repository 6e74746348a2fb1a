"""The best that can be earned in an environment, by dynamic programming on its own step."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.optimum.best_known import Known, known
    from stickslip.agents.optimum.controller import ValuePolicy
    from stickslip.agents.optimum.file import load_value_policy, save_value_policy
    from stickslip.agents.optimum.improved import Improved
    from stickslip.agents.optimum.replayed import Replay, replay
    from stickslip.agents.optimum.state_map import StateMap
    from stickslip.agents.optimum.value_iteration import Solution, solve
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "controller": ("ValuePolicy",),
            "file": ("load_value_policy", "save_value_policy"),
            "improved": ("Improved",),
            "best_known": ("Known", "known"),
            "replayed": ("Replay", "replay"),
            "value_iteration": ("Solution", "solve"),
            "state_map": ("StateMap",),
        },
    )

__all__ = [
    "Improved",
    "Known",
    "Replay",
    "Solution",
    "StateMap",
    "ValuePolicy",
    "known",
    "load_value_policy",
    "replay",
    "save_value_policy",
    "solve",
]
