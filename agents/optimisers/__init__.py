"""Optimisers on the suite: races of methods, and reports.

from stickslip.agents.optimisers import race

runs = race({"mine": my_optimiser}, ["shoot-grip-d10-v1"], budget=500)
"""

from typing import TYPE_CHECKING

from stickslip.dynamics.lazily import loaded_when_used

if TYPE_CHECKING:
    from stickslip.agents.optimisers.methods import METHODS as METHODS
    from stickslip.agents.optimisers.methods import Method as Method
    from stickslip.agents.optimisers.racing import race as race
    from stickslip.agents.optimisers.report import Run as Run
    from stickslip.agents.optimisers.report import ert as ert
    from stickslip.agents.optimisers.report import gaps as gaps
    from stickslip.agents.optimisers.report import hits as hits
    from stickslip.agents.optimisers.report import read_results as read_results
else:
    __getattr__, __dir__, __all__ = loaded_when_used(__name__)
