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
from stickslip.agents.ugv.proved import proved
from stickslip.dynamics.status import Status
from stickslip.optim.posture.bounds import bound_every_drive

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
    from stickslip.optim.posture.problem import PostureProblem

Add: TypeAlias = "Callable[[UGVEpisodes], UGVEpisodes]"
CERTIFIED = Optimum()
CLOSE = 0.05
"""Gap at which a bound is near enough to score against."""
BOUND = ("bound", "over_bound")
"""The columns of the bound."""
NO_SCORE = 1e-6
"""An optimum nearer to zero than this has no ratio to it."""


class UGVEpisodes(NamedTuple):
    """Kept data of each episode; every entry an array [episodes]."""

    reward: Array | np.ndarray
    """Sum of rewards."""
    cost: Array | np.ndarray
    """The criterion, in its unit."""
    optimum: Array | np.ndarray
    """The best over dp's grid on the same track; NaN where it was not asked for or has none. A
    drive off the grid may cost less."""
    bound: Array | np.ndarray
    """Lower bound of every drive at the same waypoints (`bound_every_drive`); NaN where it
    is not known."""
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


def _over(what: str) -> Callable[[UGVEpisodes], Interval]:
    """Mean of cost / what over the episodes that reached the end and have it."""

    def interval(played: UGVEpisodes) -> Interval:
        least = np.asarray(getattr(played, what), float)
        known = ~played.fell & np.isfinite(least) & (np.abs(least) > NO_SCORE)
        if not known.any():
            return Interval(np.nan, np.nan, np.nan)
        return mean_interval(np.asarray(played.cost[known] / least[known], float))

    return interval


def ugv_columns(unit: str) -> Columns[UGVEpisodes]:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (Column("return", "-", 1), lambda played: mean_interval(played.reward)),
        "cost": (Column("cost", unit, 2), _whole("cost")),
        "optimum": (Column("best over grid", unit, 2), _whole("optimum")),
        "score": (Column("cost / best over grid", "-", 3), _over("optimum")),
        "bound": (Column("no drive below", unit, 2), _whole("bound")),
        "over_bound": (Column("cost / no drive below", "-", 3), _over("bound")),
        "wheel_energy": (Column("wheels", "J", 1), _whole("wheel_energy")),
        "total_energy": (Column("with legs", "J", 1), _whole("total_energy")),
        "demand": (Column("friction used", "-", 3), _whole("demand")),
        "failures": (
            Column("failures", "%", 0, percent=True),
            lambda played: fraction_interval(played.fell),
        ),
    }


def keep_of(played: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """Kept data of an episode; optimum and bound are not known."""
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
        bound=jnp.full_like(state.cost, jnp.nan),
        distance=info["episode_distance"],
        wheel_energy=state.totals.wheel_energy,
        total_energy=state.totals.total_energy,
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def ugv_measures(
    env: UGVEnv, optimum: Optimum | None = CERTIFIED, bound: bool = False
) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """Measures of an environment's episodes, the criterion in its unit.

    optimum: computes the dynamic programme's value for each episode, to score against (best of all
    paths over its grid, so a continuous policy may come out slightly below 1); None for none.
    bound: whether to compute what no drive can cost less than, some seconds to minutes an episode;
    else it is what was proved before (proved.py: the environment's defaults on the named tracks),
    and not known anywhere else. No policy scores below 1 against that, but for the rounding of its
    own cost (2e-4 in single precision); where costs are below zero, as of grip to spare, none above
    1. It holds for the episode's ground, friction, start and waypoints, the criterion as the
    environment counts it at these, and any leg angles within range and rate.
    """
    env = replace(env, autoreset="disabled")
    kept = None if optimum is None and not bound else optimum or CERTIFIED

    def complete(track: str, params: UGVEnvParams, seeds: Sequence[int], say: Say) -> Add:
        say(f"dynamic programming on {track}")
        tell = say if bound else None
        best, least = known(env, params, seeds, kept or CERTIFIED, bound, tell)
        return lambda played: played._replace(optimum=best, bound=least)

    return Measures(keep_of, ugv_columns(env.measure.unit), None if kept is None else complete)


def with_bound(
    env: UGVEnv, measures: Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]
) -> Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """The measures with the columns of the bound of every drive: see ugv_measures."""
    full = ugv_measures(env, bound=True)
    kept = {*measures.columns, *BOUND}
    columns = {name: one for name, one in full.columns.items() if name in kept}
    if set(columns) != kept:  # scores of a named task, which stand first
        columns = {**measures.columns, **{name: full.columns[name] for name in BOUND}}
    return replace(full, columns=columns)


def evaluate_ugv(
    env: UGVEnv,
    controllers: Mapping[str, UGVPlayer],
    tracks: Mapping[str, UGVEnvParams],
    *,
    optimum: Optimum | None = CERTIFIED,
    bound: bool = False,
    **how: Unpack[How],
) -> Evaluation:
    """`stickslip.agents.evaluate` with another optimum to score against, with none, or with the
    bound of every drive: see ugv_measures.

    Costs are means over the episodes that reached the end. how: episodes, seeds, progress.
    """
    return evaluate_in(env, controllers, tracks, ugv_measures(env, optimum, bound), **how)


def optima(env: UGVEnv, params: UGVEnvParams, seeds: Sequence[int], optimum: Optimum) -> np.ndarray:
    """The best over the grid of each seed's episode; NaN where there is no path."""
    return known(env, params, seeds, optimum, False)[0]


def known(
    env: UGVEnv,
    params: UGVEnvParams,
    seeds: Sequence[int],
    optimum: Optimum,
    bound: bool,
    say: Say | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The same, and the bound of every drive: computed where that is asked for, else what was
    proved before, NaN where nothing was.

    say: called with a line before each episode.
    """
    best, least = [], []
    for number, seed in enumerate(seeds, 1):
        if say is not None:
            say(f"what no drive can beat in episode {number} of {len(seeds)}")
        state = first_state(env, params, seed)
        found = optimum.solve(env, params, state)
        solved = found.status.solved
        best.append(found.value if solved else np.nan)
        if not bound:
            least.append(proved(env.problem(state, params)))
            continue
        # Off the grid a drive knows better at which steps it pays: the bound begins from that.
        drive = replace(optimum, polish=True).solve(env, params, state).x if solved else None
        least.append(_bound(env.problem(state, params), drive))
    return np.asarray(best), np.asarray(least)


def _bound(problem: PostureProblem, drive: np.ndarray | None) -> float:
    """Lower bound of every drive of an episode; NaN on ground of which nothing is proved."""
    try:
        return bound_every_drive(problem, drive, tolerance=CLOSE).value
    except ValueError:  # ground given as a function
        return np.nan
