"""Batch evaluation of the UGV: controllers, planners and the optimum on the same tracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias, Unpack

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

    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.agents.evaluation.run import How, Say
    from stickslip.agents.evaluation.table import Columns, Evaluation
    from stickslip.agents.ugv.names import UGVPlayer
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

Add: TypeAlias = "Callable[[UGVEpisodes], UGVEpisodes]"
CERTIFIED = Optimum()
NO_SCORE = 1e-6
"""An optimum nearer to zero than this has no ratio to it."""


class UGVEpisodes(NamedTuple):
    """What is kept of each episode; every entry an array [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    cost: Array | np.ndarray
    """The criterion, in its unit."""
    optimum: Array | np.ndarray
    """The optimiser's value on the same track; NaN where it was not asked for or has none."""
    distance: Array | np.ndarray
    """Driven [m]."""
    wheel_energy: Array | np.ndarray
    """[J]"""
    total_energy: Array | np.ndarray
    """[J]"""
    demand: Array | np.ndarray
    """Greatest |F| / N of the stations after the first [-]."""
    status: Array | np.ndarray
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


def ugv_columns(unit: str) -> Columns[UGVEpisodes]:
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


def keep_of(played: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """What is kept of an episode; the optimum is not known."""
    state, info = jax.tree.map(lambda leaf: leaf[-1], (played.state, played.info))
    at = played.state.station
    use = [
        jnp.abs(force) / normal
        for force, normal in ((at.F_rear, at.N_rear), (at.F_front, at.N_front))
    ]
    return UGVEpisodes(
        reward=state.totals.reward,
        cost=state.cost,
        optimum=jnp.full_like(state.cost, jnp.nan),
        distance=info["episode_distance"],
        wheel_energy=state.totals.wheel_energy,
        total_energy=state.totals.total_energy,
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def ugv_measures(
    env: UGVEnv, optimum: Optimum | None = CERTIFIED
) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
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
    controllers: Mapping[str, UGVPlayer],
    tracks: Mapping[str, UGVEnvParams],
    *,
    optimum: Optimum | None = CERTIFIED,
    **how: Unpack[How],
) -> Evaluation:
    """`stickslip.agents.evaluate` with another optimum to score against, or with none.

    Costs are means over the episodes that reached the end. how: episodes, seeds, progress.
    """
    return evaluate_in(env, controllers, tracks, ugv_measures(env, optimum), **how)


def optima(env: UGVEnv, params: UGVEnvParams, seeds: Sequence[int], optimum: Optimum) -> np.ndarray:
    """The optimiser's value of each seed's episode; NaN where it finds no path."""
    found = [optimum.solve(env, params, first_state(env, params, seed)) for seed in seeds]
    return np.asarray([one.value if one.status.solved else np.nan for one in found])
