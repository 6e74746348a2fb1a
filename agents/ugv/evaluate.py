"""Batch evaluation of the UGV: controllers, planners and the optimum on the same tracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.columns import Column
from stickslip.agents.evaluation.rollout import first_state
from stickslip.agents.evaluation.run import Measures, evaluate_in
from stickslip.agents.evaluation.statistics import Interval, fraction_interval, mean_interval
from stickslip.agents.ugv.plans import Optimum
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.table import Columns, Evaluation
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams

Say = Callable[[str], None]
Add = Callable[[Any], Any]
CERTIFIED = Optimum()
NO_SCORE = 1e-6
"""An optimum nearer to zero than this has no ratio to it."""


class UGVEpisodes(NamedTuple):
    """What is kept of each episode; every entry an array [episodes]."""

    reward: Any
    """Sum of rewards."""
    cost: Any
    """The criterion, in its unit."""
    optimum: Any
    """The optimiser's value on the same track; NaN where it was not asked for or has none."""
    distance: Any
    """Driven [m]."""
    wheel_energy: Any
    """[J]"""
    total_energy: Any
    """[J]"""
    demand: Any
    """Greatest |F| / N of the stations after the first [-]."""
    status: Any
    """Status of the last step."""

    @property
    def fell(self) -> np.ndarray:
        """Ended by a status outside the model (slip, rollover, grounding, ...)."""
        return np.asarray(self.status) != Status.OK


def _whole(of: str) -> Callable[[UGVEpisodes], Interval]:
    """Mean over the episodes that reached the end; NaN without any."""

    def interval(played: UGVEpisodes) -> Interval:
        values = np.asarray(getattr(played, of), float)[~played.fell]
        return mean_interval(values) if len(values) else Interval(np.nan, np.nan, np.nan)

    return interval


def _score(played: UGVEpisodes) -> Interval:
    """Mean of cost / optimum over the episodes that reached the end and have an optimum."""
    known = ~played.fell & np.isfinite(played.optimum) & (np.abs(played.optimum) > NO_SCORE)
    if not known.any():
        return Interval(np.nan, np.nan, np.nan)
    return mean_interval(np.asarray(played.cost[known] / played.optimum[known], float))


def ugv_columns(unit: str) -> Columns:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (Column("return", "-", 1), lambda played: mean_interval(played.reward)),
        "cost": (Column("cost", unit, 2), _whole("cost")),
        "optimum": (Column("optimum", unit, 2), _whole("optimum")),
        "score": (Column("cost / optimum", "-", 3), _score),
        "wheel_energy": (Column("wheels", "J", 1), _whole("wheel_energy")),
        "total_energy": (Column("with legs", "J", 1), _whole("total_energy")),
        "demand": (Column("friction", "-", 3), _whole("demand")),
        "failures": (
            Column("failures", "%", 0, percent=True),
            lambda played: fraction_interval(played.fell),
        ),
    }


def keep_of(played: Rollout, params: UGVEnvParams) -> UGVEpisodes:
    """What is kept of an episode; the optimum is not known."""
    last = jax.tree.map(lambda leaf: leaf[-1], (played.state, played.info))
    state: Any = last[0]
    at: Any = played.state.station
    use = [
        jnp.abs(force) / normal
        for force, normal in ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    ]
    return UGVEpisodes(
        reward=state.totals.reward,
        cost=state.cost,
        optimum=jnp.full_like(state.cost, jnp.nan),
        distance=last[1]["episode_distance"],
        wheel_energy=state.totals.wheel_energy,
        total_energy=state.totals.total_energy,
        demand=jnp.max(jnp.maximum(*use)),
        status=last[1]["status"],
    )


def ugv_measures(env: UGVEnv, optimum: Optimum | None = CERTIFIED) -> Measures:
    """What is measured of an environment's episodes, the criterion in its unit.

    optimum: computes the dynamic programme's value for each episode, to score against (best of all
    paths over its grid, so a continuous policy may come out slightly below 1); None for none.
    """
    env = replace(env, autoreset="disabled")

    def complete(track: str, params: UGVEnvParams, seeds: Sequence[int], say: Say) -> Add:
        say(f"dynamic programming on {track}")
        best = optima(env, params, seeds, optimum or CERTIFIED)
        return lambda played: played._replace(optimum=best)

    return Measures(keep_of, ugv_columns(env.measure.unit), None if optimum is None else complete)


def evaluate_ugv(
    env: UGVEnv,
    controllers: Mapping[str, Any],
    tracks: Mapping[str, UGVEnvParams],
    *,
    optimum: Optimum | None = CERTIFIED,
    **how: Any,
) -> Evaluation:
    """`stickslip.agents.evaluate` with another optimum to score against, or with none.

    Costs are means over the episodes that reached the end. how: episodes, seeds, progress.
    """
    return evaluate_in(env, controllers, tracks, ugv_measures(env, optimum), **how)


def optima(env: UGVEnv, params: UGVEnvParams, seeds: Sequence[int], optimum: Optimum) -> np.ndarray:
    """The optimiser's value of each seed's episode; NaN where it finds no path."""
    found = [optimum.solve(env, params, first_state(env, params, seed)) for seed in seeds]
    return np.asarray([one.value if one.status.solved else np.nan for one in found])
