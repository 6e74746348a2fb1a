"""Optimisers on the suite: races of methods, and reports.

from stickslip.agents.optimisers import race

runs = race({"mine": my_optimiser}, ["shoot-grip-d10-v1"], budget=500)
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.optimisers.methods import METHODS, Method
    from stickslip.agents.optimisers.racing import race
    from stickslip.agents.optimisers.report import Run, ert, gaps, hits, read_results
else:
    __getattr__, __dir__ = loaded_when_used(__name__)

__all__ = ["METHODS", "Method", "Run", "ert", "gaps", "hits", "race", "read_results"]
