"""Batch evaluation: every controller in every scene over many seeds, vmapped."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation.columns import Column
from stickslip.agents.evaluation.rollout import Rollout, episode_key, horizon, rollout
from stickslip.agents.evaluation.statistics import (
    Interval,
    fraction_interval,
    mean_interval,
    ratio_interval,
)
from stickslip.dynamics.checks import require_integer, require_memory
from stickslip.dynamics.status import Status
from stickslip.envs.biped.draw import drawn_robot
from stickslip.records import table
from stickslip.records.files import write_whole
from stickslip.records.table import Table, json_text, undefined

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from stickslip.agents.protocol import Controller
    from stickslip.envs.biped.env import BipedEnv
    from stickslip.envs.biped.params import BipedEnvParams

INTERVALS = ("return",)
"""Metrics of a test during training whose interval is written, too."""
A_STEP = 300
"""Bytes that a step of an episode takes while episodes are played side by side."""
MOST_EPISODES = 65536
"""Of each controller in each scene."""
MIN_DISTANCE = 0.1
"""Mean distance per episode below which nothing is said per metre [m]."""


class Episodes(NamedTuple):
    """What is kept of each episode; every entry [episodes]."""

    reward: np.ndarray
    """Sum of rewards."""
    duration: np.ndarray
    """Control steps times control period [s]."""
    turned: np.ndarray
    """Crank angle [rad]."""
    walked: np.ndarray
    """Way of the hip, forwards positive [m]."""
    slid: np.ndarray
    """Way of the feet over the floor, either direction [m]."""
    energy: np.ndarray
    """Positive motor work and copper loss [J]."""
    weight: Any
    """[N]"""
    status: Any
    """Status of the last step."""

    @property
    def fell(self) -> np.ndarray:
        """Ended by a status outside the model (topple, lift-off, runaway, ...)."""
        return (self.status > Status.SLIP_ONSET) & (self.status != Status.STEP_COMPLETE)


COLUMNS: dict[str, tuple[Column, Callable[[Episodes], Interval]]] = {
    "return": (Column("return", "-", 2), lambda e: mean_interval(e.reward)),
    "mean_speed": (Column("speed", "m/s", 3), lambda e: mean_interval(e.walked / e.duration)),
    "mean_crank_rate": (
        Column("crank rate", "rad/s", 2),
        lambda e: mean_interval(e.turned / e.duration),
    ),
    "slip_per_metre": (
        Column("slip", "m/m", 4),
        lambda e: ratio_interval(e.slid, e.walked, MIN_DISTANCE),
    ),
    "energy_per_metre": (
        Column("energy", "J/m", 1),
        lambda e: ratio_interval(e.energy, e.walked, MIN_DISTANCE),
    ),
    "cost_of_transport": (
        Column("transport", "-", 3),
        lambda e: ratio_interval(
            e.energy, e.weight * e.walked, MIN_DISTANCE * float(np.mean(e.weight))
        ),
    ),
    "falls": (Column("falls", "%", 0, percent=True), lambda e: fraction_interval(e.fell)),
    "duration": (Column("length", "s", 1), lambda e: mean_interval(e.duration)),
}


@dataclass(frozen=True)
class Row:
    """One controller in one scene. metrics: by the names of the columns, in SI units."""

    scene: str
    controller: str
    metrics: dict[str, Interval]
    episodes: Any
    """Episodes, or another machine's."""

    @property
    def count(self) -> int:
        """Number of episodes."""
        return len(self.episodes.reward)


@dataclass(frozen=True)
class Evaluation:
    """A table with one row for each scene and controller.

    Intervals are 95 %: Student's t over episodes for means and for the ratios per metre (totals
    over totals), Wilson's for the share of falls. Where a reset draws nothing every seed is the
    same episode: it is run once, and there are no intervals. Per metre nothing is said (NaN, shown
    as "-") of controllers that walk less than MIN_DISTANCE an episode.
    """

    rows: tuple[Row, ...]
    seeds: tuple[int, ...]
    columns: Mapping[str, tuple[Column, Any]] = field(default_factory=lambda: COLUMNS)

    def row(self, scene: str, controller: str) -> Row:
        """The row of that scene and controller; ValueError if there is none."""
        for row in self.rows:
            if (row.scene, row.controller) == (scene, controller):
                return row
        known = ", ".join(f"{row.scene}/{row.controller}" for row in self.rows)
        raise ValueError(f"no row {scene}/{controller}; accepted: {known}")

    def to_markdown(self) -> str:
        """A GitHub table."""
        return self._shown().markdown()

    def to_text(self) -> str:
        """The same for a terminal: aligned, with a note on the intervals."""
        return self._shown().terminal(grouped=True)

    def write_csv(self, path: str | Path) -> Path:
        """One line a row, three columns a metric (value, low, high); empty where undefined."""
        flat = [
            {name: value for name, value in record.items() if name != "metrics"}
            | {
                f"{name}{end}": ends[which]
                for name, ends in record["metrics"].items()
                for end, which in (("", "value"), ("_low", "low"), ("_high", "high"))
            }
            for record in self._records()
        ]
        cells = [[None if undefined(value) else value for value in row.values()] for row in flat]
        return write_whole(path, Table([table.Column(name) for name in flat[0]], cells).csv())

    def write_json(self, path: str | Path, about: Mapping[str, Any] | None = None) -> Path:
        """Everything, each episode included; null where undefined. about: further entries."""
        units = {
            name: "-" if column.percent else column.unit
            for name, (column, _) in self.columns.items()
        }
        rows = [
            record | {"per_episode": row.episodes._asdict() | {"fell": row.episodes.fell}}
            for record, row in zip(self._records(), self.rows, strict=True)
        ]
        content = {"confidence": 0.95, "units": units, "seeds": list(self.seeds), "rows": rows}
        return write_whole(path, json_text(dict(about or {}) | content))

    def _records(self) -> list[dict[str, Any]]:
        return [
            {"scene": row.scene, "controller": row.controller, "episodes": row.count}
            | {"metrics": {name: value._asdict() for name, value in row.metrics.items()}}
            for row in self.rows
        ]

    def _shown(self) -> Table:
        metrics = {name: column for name, (column, _) in self.columns.items()}
        words = (table.Column(name, words=True) for name in ("scene", "controller"))
        rows = [
            [row.scene, row.controller, row.count]
            + [metrics[name].show(value) for name, value in row.metrics.items()]
            for row in self.rows
        ]
        return Table([*words, table.Column("episodes"), *metrics.values()], rows)


def evaluate(
    env: BipedEnv,
    controllers: Mapping[str, Controller[Any]],
    scenes: Mapping[str, BipedEnvParams],
    *,
    episodes: int = 32,
    seeds: Sequence[int] | None = None,
    progress: Callable[[str], None] | None = None,
) -> Evaluation:
    """Run every controller in every scene over the seeds (by default 0, 1, ..., episodes - 1).

    Seed s is the first episode after `reset(seed=s)` of every adapter. progress: called with a line
    before each row. Scenes of one structure share a compiled program for each kind of controller.
    """
    seeds = seeds_of(episodes, seeds, controllers=controllers, scenes=scenes)
    env = replace(env, autoreset="disabled")
    rows = []
    for scene, params in scenes.items():
        for name, controller in controllers.items():
            if progress is not None:
                progress(f"{name} on {scene}")
            used = seeds if is_random(params) else seeds[:1]
            played = play(env, controller.validate(), params, used)
            metrics = {metric: of(played) for metric, (_, of) in COLUMNS.items()}
            rows.append(Row(scene, name, metrics, played))
    return Evaluation(tuple(rows), seeds)


def joined(parts: Sequence[Evaluation]) -> Evaluation:
    """One table of several over the same seeds and columns: rows as they come."""
    rows = [row for part in parts for row in part.rows]
    return replace(parts[0], rows=tuple(rows))


def seeds_of(
    episodes: int, seeds: Sequence[int] | None, **given: Mapping[str, Any]
) -> tuple[int, ...]:
    """The seeds of an evaluation, by default 0, 1, ..., episodes - 1.

    ValueError if there are none, or if anything else given is empty.
    """
    if seeds is None:
        seeds = range(require_integer("episodes", episodes, low=0, high=MOST_EPISODES))
    seeds = tuple(require_integer("seeds", seed, low=0, high=2**32 - 1) for seed in seeds)
    for name, one in ({"seeds": seeds} | given).items():
        if not one:
            raise ValueError(f"{name} is empty; accepted: at least one")
    return seeds


def play(
    env: BipedEnv, controller: Controller[Any], params: BipedEnvParams, seeds: Sequence[int]
) -> Episodes:
    """The episodes of the seeds, as NumPy arrays."""
    require_room(len(seeds), horizon(params))
    keys = jax.vmap(episode_key)(jnp.asarray(seeds, jnp.uint32))
    return jax.tree.map(np.asarray, _play(env, horizon(params), controller, params, keys))


def require_room(episodes: int, steps: int) -> None:
    """Raise ValueError where so many episodes at once would not fit into memory."""
    require_memory(f"episodes = {episodes}", f"episodes of {steps} steps", episodes, steps * A_STEP)


@partial(jax.jit, static_argnums=(0, 1))
def _play(env, count: int, controller, params, keys) -> Episodes:
    return jax.vmap(lambda key: _summary(rollout(env, controller, params, key, count), params))(
        keys
    )


def _summary(played: Rollout, params: BipedEnvParams) -> Episodes:
    last = jax.tree.map(lambda leaf: leaf[-1], played.state)
    robot = drawn_robot(last.drawn, params)
    totals = last.totals
    return Episodes(
        reward=totals.reward,
        duration=last.elapsed * jnp.asarray(params.control_period, totals.reward.dtype),
        turned=totals.turned,
        walked=totals.walked,
        slid=totals.slid,
        energy=totals.energy,
        weight=robot.total_mass * robot.gravity,
        status=played.info["status"][-1],
    )


def row_of_test(
    columns: Mapping[str, tuple[Column, Callable[[Any], Interval]]],
    names: Sequence[str],
    played: Any,
) -> dict[str, float]:
    """The named metrics of episodes played, and <name>_low, <name>_high of those in INTERVALS."""
    row = {}
    for name in names:
        value = columns[name][1](played)
        row[name] = value.value
        if name in INTERVALS:
            row |= {f"{name}_low": value.low, f"{name}_high": value.high}
    return row


def is_random(params: Any) -> bool:
    """Whether a reset draws anything."""
    return bool(jax.tree.leaves(params.randomisation))
