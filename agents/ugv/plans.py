"""Planners of the UGV: whole paths computed for one episode, played back by FollowPath."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.agents.ugv.controllers import FollowPath
from stickslip.dynamics.checks import require_integer, require_kind
from stickslip.optim.posture.graph.grid import fitting_grid
from stickslip.optim.solving import solve

if TYPE_CHECKING:
    from jaxtyping import Float

    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState
    from stickslip.optim import PostureResult
    from stickslip.optim.posture.problem import PostureProblem


@dataclass(frozen=True)
class Optimum:
    """The optimiser's path for the whole episode, by `solve(problem, "dp")`.

    angles: least number of the grid's angles, for each leg (see `fitting_grid`). Knows ground and
    friction; no path on its grid is better, off the grid some are. polish: go on to a local optimum
    off the grid, from the best path on it; of the two the better one.
    """

    angles: int = 31
    polish: bool = False

    def validate(self) -> Optimum:
        """Return self, or raise ValueError naming the field."""
        require_integer("angles", self.angles, low=2)
        require_kind("polish", self.polish, bool, "True or False")
        return self

    def solve(self, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState) -> PostureResult:
        """The result for the episode that begins in `state`."""
        problem = env.problem(state, params)
        return _best_from_grid(problem, self.angles, self.polish)

    def path(self, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState) -> FollowPath:
        """The path, or the legs held where there is none."""
        return _follow(self.solve(env, params, state).leg_angles, state, params)


@dataclass(frozen=True)
class RecedingHorizon:
    """At every waypoint plan the next `horizon` steps by dynamic programming and take the first.

    Sees the ground that far ahead exactly, and friction. angles: least number of the grid's, for
    each leg (see `fitting_grid`). What lies behind the horizon counts nothing. A planner:
    nothing disturbs the vehicle, so its moves are computed before the drive. Within a horizon of
    the end the last plan is followed, which planning again would only repeat. Where no plan exists
    the legs are held from there on.
    """

    horizon: int = 15
    angles: int = 21

    def validate(self) -> RecedingHorizon:
        """Return self, or raise ValueError naming the field."""
        require_integer("horizon", self.horizon)
        require_integer("angles", self.angles, low=2)
        return self

    def path(self, env: UGVEnv, params: UGVEnvParams, state: UGVEnvState) -> FollowPath:
        """All moves of the episode that begins in `state`."""
        problem = env.problem(state, params)
        steps = len(problem.x) - 1
        horizon = min(self.horizon, steps)
        taken = [np.asarray(problem.start_angles, float)]
        for k in range(steps - horizon + 1):
            plan = self._plan(problem, k, k + horizon, taken[-1])
            if plan is None:
                break
            taken.extend(plan[1:] if k == steps - horizon else plan[1:2])
        return _follow(np.stack(taken), state, params)

    def _plan(
        self, problem: PostureProblem, first: int, last: int, start: Float[np.ndarray, "2"]
    ) -> Float[np.ndarray, "k 2"] | None:
        part = replace(problem, x=problem.x[first : last + 1], start_angles=start)
        return _best_from_grid(part, self.angles).leg_angles


def _best_from_grid(problem: PostureProblem, least: int, polish: bool = False) -> PostureResult:
    """The best path over the grid that fits, or what polishing makes of it."""
    return solve(problem, "dp", polish=polish, angles=fitting_grid(problem, least))


def _follow(
    angles: Float[np.ndarray, "K 2"] | None, state: UGVEnvState, params: UGVEnvParams
) -> FollowPath:
    """The path, its last pair held up to the end; the legs held where there is none."""
    if angles is None:
        angles = np.asarray(jax.device_get(state.leg_angles), float)[None]
    missing = int(params.steps) + 1 - len(angles)
    return FollowPath(np.concatenate([angles, np.repeat(angles[-1:], missing, axis=0)])).validate()
