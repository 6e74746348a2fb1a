"""A posture by evolution."""

import sys

from stickslip.dynamics.ugv import Track
from stickslip.optim import PostureProblem, solve

problem = PostureProblem.along(Track.bump(), "total_energy", spacing=2.0)
result = solve(problem, method="cma", seed=1)
if not result.status.solved:
    sys.exit(f"not solved: {result}")
