"""What is measured of the UGV's episodes, and their plots and pages."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.agents.evaluation import table
from stickslip.agents.pictures import episodes
from stickslip.dynamics.status import Status
from stickslip.envs.rendering.page import Episode, Line, Panel
from stickslip.envs.ugv.picture import UGVFrame, ugv_frames, ugv_picture

if TYPE_CHECKING:
    from jaxtyping import Array

    from stickslip.agents.evaluation.rollout import Rollout
    from stickslip.envs.tasks.known import Scale
    from stickslip.envs.ugv.env import UGVEnv
    from stickslip.envs.ugv.params import UGVEnvParams
    from stickslip.envs.ugv.state import UGVDrawn, UGVEnvState


class UGVEpisodes(NamedTuple):
    """Kept data of each episode; every entry an array [episodes].

    reward: sum. cost: the criterion, in its unit. distance: driven [m]. wheel_energy, total_energy
    [J]. demand: greatest |F| / N of the stations after the first [-]. status: of the last step.
    """

    reward: Array | np.ndarray
    cost: Array | np.ndarray
    distance: Array | np.ndarray
    wheel_energy: Array | np.ndarray
    total_energy: Array | np.ndarray
    demand: Array | np.ndarray
    status: Array | np.ndarray

    @property
    def fell(self) -> np.ndarray:
        """Ended by a status outside the model (slip, rollover, grounding, ...)."""
        return np.asarray(self.status) != Status.OK


def _whole(kept: UGVEpisodes, of: str) -> table.Interval:
    """Mean over the episodes that reached the end; NaN without any."""
    values = np.asarray(getattr(kept, of), float)[~kept.fell]
    return table.mean_interval(values) if len(values) else table.Interval(np.nan)


def ugv_columns(unit: str) -> table.Columns[UGVEpisodes]:
    """The columns of a table; unit: the criterion's."""
    return {
        "return": (table.Column("return", "-", 1), lambda e: table.mean_interval(e.reward)),
        "cost": (table.Column("cost", unit, 2), partial(_whole, of="cost")),
        "wheel_energy": (table.Column("wheels", "J", 1), partial(_whole, of="wheel_energy")),
        "total_energy": (table.Column("with legs", "J", 1), partial(_whole, of="total_energy")),
        "demand": (table.Column("friction used", "-", 3), partial(_whole, of="demand")),
        "failures": table.FAILURES,
    }


def keep_of(rollout: Rollout[UGVEnvState], params: UGVEnvParams) -> UGVEpisodes:
    """Kept data of an episode."""
    state, info = jax.tree.map(lambda leaf: leaf[-1], (rollout.state, rollout.info))
    use = [jnp.abs(force) / normal for force, normal, _ in rollout.state.station.wheels]
    return UGVEpisodes(
        **state.totals._asdict(),
        cost=state.cost,
        distance=info["episode_distance"],
        demand=jnp.max(jnp.maximum(*use)),
        status=info["status"],
    )


def measures(env: UGVEnv) -> table.Measures[UGVEnvState, UGVEnvParams, UGVEpisodes]:
    """See Machine; the criterion in its unit."""
    unit = env.measure.unit
    kept = {"reward": "-", "cost": unit, "distance": "m", "wheel_energy": "J", "total_energy": "J"}
    return table.Measures(keep_of, ugv_columns(unit), kept | {"demand": "-"})


GROUND, LEGS = "ground under the wheels", "leg angles, 90 straight down"
TORQUE = "torque on each wheel, negative drives forwards"


def as_episode(
    rollout: Rollout[UGVEnvState],
    env: UGVEnv,
    params: UGVEnvParams,
    name: str,
    scale: Scale | None = None,
) -> Episode:
    """One episode (not a batch), waypoint by waypoint. Time is that of pictures (params.speed):
    nothing else of the model knows of it, so there is work for a metre and no power."""
    rollout = rollout.trimmed()
    states, infos = episodes.samples(rollout)
    frame = ugv_frames(states, infos, params, env.solver, env.preview)
    unit, criterion = env.measure.unit, env.measure.name.replace("_", " ")
    totals, cost = rollout.info, np.asarray(states.cost, float)
    whole = [
        ("return", float(totals["episode_return"][-1]), unit),
        ("wheels", float(totals["episode_wheel_energy"][-1]), "J"),
        ("with legs", float(totals["episode_total_energy"][-1]), "J"),
        ("shown at", float(params.speed), "m/s"),
    ]
    shown = ugv_picture(frame, params.vehicle, criterion, unit)
    return Episode(
        **vars(shown),
        name=name,
        period=float(params.control_period),
        panels=(
            *_panels(frame, rollout, float(params.spacing)),
            episodes.panel(criterion, unit, cost),
            *episodes.reward_panels(rollout, {}, unit, scale),
        ),
        events=episodes.slip_events(
            frame.slips, lambda _: "a wheel slips", "both wheels grip", shown.ended
        ),
        facts=(*episodes.facts(whole), *_drawn(rollout.start_state.drawn)),
        axis=("front wheel [m]", np.asarray(frame.at.x)),
    )


def _drawn(drawn: UGVDrawn) -> tuple[tuple[str, str], ...]:
    """Draws of the episode's reset."""
    rows = [] if drawn.friction is None else [("friction, drawn", float(drawn.friction), "-")]
    ground = () if drawn.odometer is None else (("ground", "drawn"),)
    return (*ground, *episodes.facts(rows))


def _panels(frame: UGVFrame, rollout: Rollout[UGVEnvState], spacing: float) -> tuple[Panel, ...]:
    """Ground, legs, torque, work, friction and grip, waypoint by waypoint."""
    heights = frame.wheels("point")[..., 1].T
    angles = np.degrees(frame.at.leg_angles.T)
    names = {"motors": "wheel_work", "with the legs": "total_work"}
    work = {who: episodes.from_start(rollout.info[name]) / spacing for who, name in names.items()}
    used = Line("greater |F| / N", frame.demand)
    return (
        episodes.panel(GROUND, "m", {"rear": heights[0], "front": heights[1]}),
        episodes.panel(LEGS, "°", {"rear": angles[0], "front": angles[1]}),
        episodes.panel(TORQUE, "N m", np.asarray(frame.at.torque)),
        episodes.panel("work put in, for each metre", "J/m", work, steps=True),
        episodes.beside("friction used", "-", used, "friction there is", frame.mu),
        episodes.panel("margin of grip", "kN", np.asarray(frame.at.grip) / 1000, limits=(0.0,)),
    )
