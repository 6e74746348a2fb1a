"""The best that can be earned in an environment, by dynamic programming on its own step."""

from stickslip.agents.optimum.grid import Axis, Grid, Place, Sheet
from stickslip.agents.optimum.policy import Ahead, StateMap, ValuePolicy
from stickslip.agents.optimum.solution import Known, Replay, Solution, known, replay, solve

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
    "replay",
    "solve",
]
