"""A posture by evolution."""

import sys

from stickslip.dynamics.ugv import Track
from stickslip.optim import PostureProblem, solve

problem = PostureProblem.along(Track.bump(), "total_energy", spacing=2.0)
result = solve(problem, method="cma", seed=1, evaluations=200, population=8)
if not (result.feasible and result.evaluations >= 200):
    sys.exit(f"no drive was found: {result}")
