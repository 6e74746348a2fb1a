"""Dynamic programming over a grid of states, for any deterministic process of few coordinates."""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.optim.dynamic_programming.grid import Axis, Cell, Grid, Place, Sheet
    from stickslip.optim.dynamic_programming.lookahead import Ahead, Found, look_ahead
    from stickslip.optim.dynamic_programming.outcomes import Transitions, transitions
    from stickslip.optim.dynamic_programming.process import Process, Transition
    from stickslip.optim.dynamic_programming.sweeps import (
        Values,
        average_reward,
        finite_horizon,
        greedy,
    )
else:
    __getattr__, __dir__ = loaded_when_used(
        __name__,
        {
            "grid": ("Axis", "Cell", "Grid", "Place", "Sheet"),
            "lookahead": ("Ahead", "Found", "look_ahead"),
            "process": ("Transition", "Process"),
            "sweeps": ("Values", "average_reward", "finite_horizon", "greedy"),
            "outcomes": ("Transitions", "transitions"),
        },
    )

__all__ = [
    "Ahead",
    "Axis",
    "Cell",
    "Found",
    "Grid",
    "Place",
    "Process",
    "Sheet",
    "Transition",
    "Transitions",
    "Values",
    "average_reward",
    "finite_horizon",
    "greedy",
    "look_ahead",
    "transitions",
]
