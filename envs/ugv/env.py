"""UGVEnv: a vehicle on two legs asked to drive along a track with the best posture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import require_choice, require_integer, require_kind, require_known
from stickslip.dynamics.pytrees import compensated, rebuilt
from stickslip.dynamics.status import Status
from stickslip.dynamics.ugv import PoseSolver, Track
from stickslip.dynamics.ugv.poses import stand
from stickslip.envs.functional import Entries, FunctionalEnv, with_keywords_of, with_tuples
from stickslip.envs.ugv import state as episode
from stickslip.envs.ugv.params import UGVEnvParams, make_params, penalty_for
from stickslip.envs.ugv.randomisation import RandomTrack, UGVRandomisation
from stickslip.optim.posture import criteria
from stickslip.optim.posture.problem import PostureProblem

if TYPE_CHECKING:
    from jaxtyping import Array, Float


MAX_SLOPE = 1.6
"""Clip of slope angle and pitch [rad]."""
MAX_TORQUE = 2.0
"""Clip of the torque on a wheel, in weight x wheel radius."""
MAX_GRIP = 4.0
"""Clip of the grip margin, in weights."""
MAX_HEIGHT = 5.0
"""Clip of height or depth of the ground ahead, in wheel radii."""
MAX_COST = 10.0
"""Clip of the worst value so far, in units of `penalty_for`."""
MAX_FRICTION = 10.0
"""Clip of the friction coefficient ahead [-]."""


def _track(track: Any) -> Any:
    """A track: a name, or {name: {...}} with the named track's arguments."""
    if not isinstance(track, dict):
        return track
    ((name, numbers),) = track.items()
    return Track.named(name, **numbers)


def _ranges(given: Entries) -> UGVRandomisation:
    """A UGVRandomisation: ranges as pairs, by its names; its track by the names of RandomTrack."""
    drawn = with_tuples(given)
    if "track" in drawn:
        drawn["track"] = RandomTrack(**with_tuples(drawn["track"]))
    return UGVRandomisation(**drawn)


@dataclass(frozen=True)
class UGVEnv(FunctionalEnv[episode.UGVEnvState, UGVEnvParams]):
    """A UGV drives along a track and moves its legs to minimise a criterion.

    One step takes the front wheel `spacing` (0.1 m) further along x. There is no time: the vehicle
    is in equilibrium everywhere (`stickslip.dynamics.ugv`: no inertia; rolling resistance where the
    vehicle has it). Leg angles change linearly with the distance. The criterion takes the stations
    at the ends of steps, with the trapezoid rule between them.

    ## Action
    | index | name | range | meaning |
    | --- | --- | --- | --- |
    | 0 | rear leg rate | [-1, 1] | turn of the rear leg outwards, times `leg_rate` (1 rad/m) |
    | 1 | front leg rate | [-1, 1] | turn of the front leg outwards, the same |

    Rates and angles saturate at the ends of their ranges (angles: 30 to 150 degrees).
    info["rear_angle"] and info["front_angle"] are the resulting angles.

    ## Observation
    W is the vehicle's weight, r the wheels' radius.
    | entry | unit | range | when |
    | --- | --- | --- | --- |
    | rear leg's angle beyond straight down | rad | the legs' range less pi/2 | always |
    | front leg's angle beyond straight down | rad | the same | always |
    | pitch of the body, nose up | rad | +- 1.6, clipped | always |
    | slope of the ground under the rear wheel | rad | +- 1.6, clipped | always |
    | slope of the ground under the front wheel | rad | +- 1.6, clipped | always |
    | torque on each wheel; driving forwards is negative | W r | +- 2, clipped | always |
    | margin of grip at the rear wheel, mu N - abs(F) | W | +- 4, clipped | always |
    | margin of grip at the front wheel | W | +- 4, clipped | always |
    | worst value so far; 0 before the first step | `penalty_for` | +- 10, clipped | "max" |
    | height of the ground ahead over the front contact, one a point | r | +- 5, clipped | always |
    | friction coefficient there, one a point | - | [0, 10] | `see_friction` |

    The `preview` (8) points lie evenly along x ahead of the front contact, the last one
    `preview_length` (2 m) ahead. With `preview_noise` [m] heights have independent normal errors of
    this standard deviation. "max": criteria that are a worst value over the stations.

    ## Reward
    Minus the increase of the criterion (`stickslip.optim.CRITERIA`) in this step, in its own unit.
    So the return of an episode that reaches the end is minus the value of the `PostureProblem` with
    the same track and waypoints. A step that fails earns - `failure_penalty` and adds no cost. The
    default penalty exceeds the cost of any drive to the end (see `penalty_for`), so a failure never
    pays. `reward_scale` (1) multiplies both. For "max" criteria the first step counts the worst of
    the first two stations.

    ## Start
    The front wheel stands at `start`, by default so far in that the rear wheel is on the track in
    every posture. The legs are straight down, or at `start_angles`. `UGVRandomisation` draws
    ground, friction and angles.

    ## Options of a reset
    `reset(options={...})` of the adapters, for one episode; a given option is not drawn:
    | option | unit | accepted |
    | --- | --- | --- |
    | start_angles | rad | rear and front, within the legs' range |

    ## End
    Terminated, with the Status in info["status"]: OVERLAP (the wheel centres are closer than 2 r
    plus `wheel_gap`; `PoseSolver(overlap=True)` allows it, to compare with the
    chapter), WHEEL_SLIP (a wheel needs more than mu N), ROLLOVER (N <= 0), GROUNDED (body or legs
    lower than `min_clearance`), OVERLOAD (a wheel needs more than `max_torque`, where that is
    given), HOLLOW_GROUND, NO_SOLUTION, NOT_CONVERGED, NON_FINITE. The state stays at the station
    before. An episode that starts in such a station ends with its first step. Truncated: at the
    last waypoint before `end` (the track's).

    ## Info
    Of the station reached (of the one before, if the step failed): status, x [m], rear_angle,
    front_angle, pitch [rad], torque [N m], friction_force (of the front wheel; with rolling
    resistance the rear one's differs), N_rear, N_front, grip (the lesser margin) [N], clearance
    [m]. Of the step: cost, what a constraint limits, 1 if it failed, else 0 (not the criterion,
    see episode_cost); wheel_work, total_work: put in by the motors (electrical energy where the
    vehicle has efficiencies), and with the legs [J]; final_obs, autoreset. Of the episode so far:
    episode_return, episode_length [steps], episode_cost (the criterion), episode_distance [m],
    episode_wheel_energy, episode_total_energy [J].

    Static choices: criterion (a name of CRITERIA), preview (points, 0 for none), solver (see
    PoseSolver), autoreset, see_friction. Version 0.
    """

    criterion: str = "wheel_energy"
    preview: int = 8
    solver: PoseSolver = field(default=PoseSolver())
    autoreset: str = "same_step"
    see_friction: bool = field(default=False, repr=False)

    action_names = ("rear leg rate", "front leg rate")
    params_kind, state_kind = UGVEnvParams, episode.UGVEnvState
    option_names = ("start_angles",)
    readers: ClassVar = {
        "track": _track,
        "randomisation": _ranges,
        "solver": lambda settings: PoseSolver(**settings),
    }

    def __post_init__(self):
        super().__post_init__()
        require_choice("criterion", self.criterion, tuple(criteria.CRITERIA))
        most = episode.MOST_PREVIEW
        accepted = f"an integer from 0 to {most}"
        require_integer("preview", self.preview, low=0, high=most, accepted=accepted)
        require_kind("solver", self.solver, PoseSolver, "a PoseSolver")
        require_kind("see_friction", self.see_friction, bool, "True or False")

    @property
    def measure(self) -> criteria.Criterion:
        """The criterion itself."""
        return criteria.CRITERIA[self.criterion]

    def episode_params(self, params: UGVEnvParams, options: Mapping[str, Any]) -> UGVEnvParams:
        """See FunctionalEnv; what the options set is not drawn."""
        params = super().episode_params(params, options)
        if not options:
            return params
        if (shape := np.shape(options["start_angles"])) != (2,):
            raise ValueError(f"start_angles has shape {shape}; accepted: two angles [rad]")
        drawn = replace(params.randomisation, start_angles=None)
        changed = params.replace(randomisation=drawn, **options)
        own = {name: getattr(changed, name) for name in ("randomisation", "start_angles")}
        return rebuilt(params, **own)  # other entries keep their last digits

    @property
    def default_params(self) -> UGVEnvParams:
        """Default vehicle on the chapter's bump, mu = 0.8, legs straight down at first."""
        return self.make_params()

    @with_keywords_of(make_params)
    def make_params(self, **changes: Any) -> UGVEnvParams:
        """Parameters with some entries changed: vehicle, track (a Track, or a name of
        stickslip.dynamics.ugv.TRACKS or stickslip.dynamics.names.RANDOM_TRACKS), randomisation,
        dtype or any number of UGVEnvParams. ValueError naming the field or name."""
        require_known(changes, self.parameter_names(), "parameter of UGVEnv")
        return make_params(self.measure, **changes)

    def reset_env(
        self, key: Array, params: UGVEnvParams
    ) -> tuple[Float[Array, " obs"], episode.UGVEnvState]:
        drawn, angles = episode.draw(key, params)
        zero = jnp.zeros((), angles.dtype)
        nothing = episode.UGVTotals(*[zero] * len(episode.UGVTotals._fields))
        station, attitude = self._stand(params.waypoint(0), angles, drawn, params)
        state = episode.UGVEnvState(
            station=station,
            attitude=attitude,
            elapsed=jnp.zeros((), jnp.int32),
            cost=zero,
            over=jnp.zeros((), bool),
            drawn=drawn,
            totals=nothing,
            rests=(zero, nothing),
        )
        return self._observe(state, params), state

    def step_env(
        self, state: episode.UGVEnvState, action: Float[Array, " 2"], params: UGVEnvParams
    ) -> tuple[Float[Array, " obs"], episode.UGVEnvState, Array, Array, Array, dict[str, Any]]:
        dtype = state.cost.dtype
        before, elapsed = state.station, state.elapsed + 1
        turn = params.leg_rate * params.spacing * jnp.asarray(action, dtype)
        low, high = params.vehicle.leg_angle_min, params.vehicle.leg_angle_max
        angles = jnp.clip(before.leg_angles + turn, low, high)
        after, attitude = self._stand(params.waypoint(elapsed), angles, state.drawn, params)
        status = jnp.where(before.status != Status.OK, before.status, after.status)
        failed = status != Status.OK
        last = (before, state.attitude)
        after, attitude = jax.tree.map(partial(jnp.where, failed), last, (after, attitude))
        measure, first = self.measure.of(params.vehicle), state.elapsed == 0
        more = criteria.increase(measure, state.cost, before, after, first)
        more = jnp.where(failed, 0.0, more).astype(dtype)
        reward = -params.reward_scale * (more + jnp.where(failed, params.failure_penalty, 0.0))
        wheel_work, total_work = (
            jnp.asarray(
                criteria.step_cost(criteria.CRITERIA[name].of(params.vehicle), before, after), dtype
            )
            for name in ("wheel_energy", "total_energy")
        )
        added = (more, episode.UGVTotals(reward, wheel_work, total_work))
        (cost, totals), rests = compensated((state.cost, state.totals), state.rests, added)
        done = elapsed >= params.steps
        state = replace(
            state,
            station=after,
            attitude=attitude,
            elapsed=elapsed,
            cost=cost,
            over=failed | done,
            totals=totals,
            rests=rests,
        )
        work = {"wheel_work": wheel_work, "total_work": total_work}
        info = {"status": status, "cost": failed.astype(dtype), **work}
        info |= episode.info_of(state, params)
        return self._observe(state, params), state, reward, failed, done & ~failed, info

    def pictures(self, states, infos, params):
        """See FunctionalEnv (extra `viz`)."""
        from stickslip.envs.rendering.scene import paint
        from stickslip.envs.ugv.picture import ugv_frames, ugv_picture

        frames = ugv_frames(states, infos, params, self.solver, self.preview)
        shown = ugv_picture(frames, params.vehicle, self.criterion, self.measure.unit)
        return partial(paint, shown)

    def observation_bounds(self, params: UGVEnvParams) -> tuple[np.ndarray, np.ndarray]:
        """See FunctionalEnv; entries as in the class docstring."""
        low = float(np.min(np.asarray(params.vehicle.leg_angle_min))) - np.pi / 2
        high = float(np.max(np.asarray(params.vehicle.leg_angle_max))) - np.pi / 2
        slack = 1e-6  # an angle at the end of its range, in single precision
        rows = [(low - slack, high + slack)] * 2 + [(-MAX_SLOPE, MAX_SLOPE)] * 3
        rows += [(-MAX_TORQUE, MAX_TORQUE)] + [(-MAX_GRIP, MAX_GRIP)] * 2
        rows += [(-MAX_COST, MAX_COST)] * (self.measure.kind == "max")
        rows += [(-MAX_HEIGHT, MAX_HEIGHT)] * self.preview
        rows += [(0, MAX_FRICTION)] * (self.preview if self.see_friction else 0)
        lows, highs = np.asarray(rows, np.float64).T
        return lows, highs

    def _observe(self, state: episode.UGVEnvState, params: UGVEnvParams) -> Float[Array, " obs"]:
        at, dtype = state.station, state.cost.dtype
        W, r = params.vehicle.weight, params.vehicle.wheel_radius
        margins = [mu * normal - jnp.abs(force) for force, normal, mu in at.wheels]
        entries = [*(at.leg_angles - np.pi / 2)]
        entries += [jnp.clip(angle, -MAX_SLOPE, MAX_SLOPE) for angle in state.attitude]
        entries += [jnp.clip(at.torque / (W * r), -MAX_TORQUE, MAX_TORQUE)]
        entries += [jnp.clip(margin / W, -MAX_GRIP, MAX_GRIP) for margin in margins]
        if self.measure.kind == "max":
            mu = jnp.max(at.friction) if jnp.ndim(at.friction) else at.friction  # better wheel
            unit = penalty_for(self.measure.unit, params.vehicle, mu, params.end - params.start)
            entries += [jnp.clip(state.cost / unit, -MAX_COST, MAX_COST)]
        seen = jnp.stack([jnp.asarray(entry, dtype) for entry in entries])
        if self.preview == 0:
            return seen
        heights = episode.heights_ahead(self.preview, state, params) / r
        ahead = [jnp.clip(heights, -MAX_HEIGHT, MAX_HEIGHT).astype(dtype)]
        if self.see_friction:
            mu = episode.friction_ahead(self.preview, state, params)
            ahead += [jnp.minimum(mu, MAX_FRICTION).astype(dtype)]
        return jnp.concatenate([seen, *ahead])

    def problem(self, state: episode.UGVEnvState, params: UGVEnvParams) -> PostureProblem:
        """The optimiser's problem of an episode, from its first state (not a batch): the same
        ground, friction, waypoints, limits and start. Its objective is minus the episode's return
        (at reward_scale 1), its optimum a bound for every policy."""
        odometer, friction = episode.ground(state.drawn, params)
        own: Any = params.vehicle, odometer.track
        vehicle, track = jax.tree.map(lambda leaf: np.asarray(leaf, np.float64), own)
        return PostureProblem(
            params=vehicle,
            track=track,
            x=params.waypoints(),
            criterion=self.criterion,
            friction=float(friction),
            leg_rate=float(params.leg_rate),
            min_clearance=float(params.min_clearance),
            max_torque=None if params.max_torque is None else float(params.max_torque),
            start_angles=np.asarray(state.leg_angles, float),
            solver=self.solver,
            apart_between=False,  # as in an episode
        )

    def _stand(
        self,
        x: Float[Array, ""],
        angles: Float[Array, " 2"],
        drawn: episode.UGVDrawn,
        params: UGVEnvParams,
    ) -> tuple[criteria.Station, episode.Attitude]:
        """Station and attitude with the front wheel touching at x."""
        odometer, friction = episode.ground(drawn, params)
        vehicle = params.vehicle
        placed = stand(vehicle, odometer.track, x, angles, self.solver)
        station = criteria.station_of(vehicle, odometer, placed, angles, friction)
        low = (station.status == Status.OK) & (station.clearance < params.min_clearance)
        status = jnp.where(low, Status.GROUNDED, station.status)
        if params.max_torque is not None:
            left = jnp.min(jnp.stack(criteria.torque_left(station, params.max_torque)), 0)
            status = jnp.where((status == Status.OK) & (left < 0), Status.OVERLOAD, status)
        station = station._replace(status=status.astype(jnp.int32))
        attitude = episode.Attitude(placed.pitch, placed.rear.slope_angle, placed.front.slope_angle)
        return station, attitude
