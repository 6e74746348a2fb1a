"""Batch evaluation of the UGV: controllers, planners and the optimum on the same tracks."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.biped.evaluate import Evaluation, Row, is_random, require_room, seeds_of
from stickslip.agents.evaluation.columns import Column
from stickslip.agents.evaluation.rollout import episode_key, horizon, rollout
from stickslip.agents.evaluation.statistics import Interval, fraction_interval, mean_interval
from stickslip.agents.ugv.plans import Optimum
from stickslip.dynamics.status import Status

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVEnvState

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


def ugv_columns(unit: str) -> dict[str, tuple[Column, Callable[[Any], Interval]]]:
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


def evaluate_ugv(
    env: UGVEnv,
    controllers: Mapping[str, Any],
    tracks: Mapping[str, UGVEnvParams],
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    optimum: Optimum | None = CERTIFIED,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """Run every controller or planner on every track over the seeds (by default 0, 1, ...).

    optimum: computes the dynamic programme's value for each episode, to score against (best of all
    paths over its grid, so a continuous policy may come out slightly below 1); None for none. Where
    a reset draws nothing one episode is run. Costs are means over the episodes that reached the
    end.
    """
    seeds = seeds_of(episodes, seeds, controllers=controllers, tracks=tracks)
    env = replace(env, autoreset="disabled")
    columns, rows = ugv_columns(env.measure.unit), []
    say = progress or (lambda line: None)
    for track, params in tracks.items():
        used = seeds if is_random(params) else seeds[:1]
        best = np.full(len(used), np.nan)
        if optimum is not None:
            say(f"dynamic programming on {track}")
            best = optima(env, params, used, optimum)
        for name, controller in controllers.items():
            say(f"{name} on {track}")
            played = play_ugv(env, controller.validate(), params, used)._replace(optimum=best)
            metrics = {metric: of(played) for metric, (_, of) in columns.items()}
            rows.append(Row(track, name, metrics, played))
    return Evaluation(tuple(rows), seeds, columns)


def optima(env: UGVEnv, params: UGVEnvParams, seeds: Sequence[int], optimum: Optimum) -> np.ndarray:
    """The optimiser's value of each seed's episode; NaN where it finds no path."""
    found = [optimum.solve(env, params, first_state(env, params, seed)) for seed in seeds]
    return np.asarray([one.value if one.status.solved else np.nan for one in found])


def first_state(env: UGVEnv, params: UGVEnvParams, seed: int) -> UGVEnvState:
    """The state in which a seed's first episode begins."""
    return env.reset(episode_key(seed), params)[1]


def play_ugv(
    env: UGVEnv, controller: Any, params: UGVEnvParams, seeds: Sequence[int]
) -> UGVEpisodes:
    """The episodes of the seeds, as NumPy arrays. A planner (with `path`) plans each of them."""
    count = horizon(params)
    require_room(len(seeds), count)
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    if not hasattr(controller, "path"):
        played = _play(env, count, controller, None, params, keys)
    else:
        paths = [controller.path(env, params, first_state(env, params, seed)) for seed in seeds]
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *paths)
        played = _play(env, count, stacked, 0, params, keys)
    return jax.tree.map(np.asarray, played)


@partial(jax.jit, static_argnums=(0, 1, 3))
def _play(env, count: int, controller, axis: int | None, params, keys) -> UGVEpisodes:
    def one(controller, key):
        return _summary(rollout(env, controller, params, key, count))

    return jax.vmap(one, (axis, 0))(controller, keys)


def _summary(played: Rollout) -> UGVEpisodes:
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
