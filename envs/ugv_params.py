"""Numbers of the UGV environment: vehicle, ground, task, reward and what is randomised."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.checks import is_concrete, require_number
from stickslip.dynamics.numeric import Numeric
from stickslip.dynamics.ugv import Odometer, Track, UGVParams
from stickslip.envs.ugv_draw import UGVRandomisation
from stickslip.optim.waypoints import waypoints_along

if TYPE_CHECKING:
    from stickslip.optim.criteria import Criterion


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class UGVEnvParams:
    """Parameters of UGVEnv, a pytree to vmap over. Build it with `UGVEnv.make_params`.

    vehicle: the UGV. odometer: the ground and the arc length along it; a drawn ground takes its
    place. randomisation: what a reset draws.
    friction: mu between wheels and ground [-]. leg_rate: how far action 1 turns a leg for each
    metre that the front wheel advances [rad/m]. spacing: how far it advances in a step [m]. start,
    end: where it stands at first and at last [m]. start_angles: of the legs [2], rear and front
    [rad]. min_clearance: body and legs must be as far above the ground [m].
    preview_length: how far ahead the ground is seen [m]. preview_noise: standard deviation of each
    height seen [m], or None for exact ones.
    failure_penalty: taken off the reward, once, when the episode terminates, in the criterion's
    unit. reward_scale: factor on the whole reward; 1 leaves it in the criterion's unit.
    speed: of the front wheel along x in pictures [m/s]; nothing else knows of time.
    """

    vehicle: UGVParams
    odometer: Odometer
    randomisation: UGVRandomisation
    friction: Numeric
    leg_rate: Numeric
    spacing: Numeric
    start: Numeric
    end: Numeric
    start_angles: Numeric
    min_clearance: Numeric
    preview_length: Numeric
    preview_noise: Numeric | None
    failure_penalty: Numeric
    reward_scale: Numeric
    speed: Numeric

    @property
    def track(self) -> Track:
        """The ground, where none is drawn."""
        return self.odometer.track

    @property
    def steps(self):
        """Steps of a whole episode: the last waypoint is at or less than `spacing` before end."""
        return jnp.floor((self.end - self.start) / self.spacing + 1e-3).astype(int)

    @property
    def control_period(self):
        """What a step takes at the speed of the pictures [s]."""
        return self.spacing / self.speed

    @property
    def time_limit(self):
        """What a whole episode takes at the speed of the pictures [s]."""
        return self.steps * self.control_period

    def waypoint(self, step):
        """Where the front wheel is after so many steps [m]."""
        return self.start + self.spacing * jnp.asarray(step).astype(jnp.result_type(self.start))

    def waypoints(self) -> np.ndarray:
        """Every place of the front wheel in a whole episode, the start included [m]: float64,
        of the numbers that the environment has, rounded as it rounds them."""
        return np.asarray(self.waypoint(np.arange(int(self.steps) + 1)), np.float64)

    def replace(self, **changes: Any) -> UGVEnvParams:
        """A copy with some entries changed, validated: fields, or `track`. The numbers take the
        type of those before. ValueError for an unknown name."""
        known = [*(field.name for field in fields(self)), "track"]
        for name in changes:
            if name not in known:
                raise ValueError(f"{name!r} is no field; accepted: {', '.join(known)}")
        dtype = jnp.result_type(self.start)
        track = changes.pop("track", None)
        changed = replace(self, **changes)
        if track is not None:
            changed = replace(changed, odometer=_odometer(track, changed.start, changed.end, dtype))
        return _cast(changed.validate(), dtype)

    def validate(self) -> UGVEnvParams:
        """Return self, or raise ValueError naming the field, the value and what is accepted."""
        self.vehicle.validate()
        for name in POSITIVE:
            require_number(name, getattr(self, name), low=0.0, strict=True, accepted="finite, > 0")
        for name in NON_NEGATIVE:
            require_number(name, getattr(self, name), low=0.0, accepted="finite, >= 0")
        if self.preview_noise is not None:
            accepted = "None, or a finite length >= 0 [m]"
            require_number("preview_noise", self.preview_noise, low=0.0, accepted=accepted)
        for name in ("start", "end"):
            require_number(name, getattr(self, name), low=-np.inf, accepted="a finite place [m]")
        if is_concrete(self.start, self.end, self.spacing) and np.any(np.asarray(self.steps) < 1):
            raise ValueError(
                f"start = {self.start}, end = {self.end} with spacing = {self.spacing}; accepted: "
                "start + spacing <= end [m]"
            )
        self.vehicle.check_leg_angles(self.start_angles)
        self.randomisation.validate(self.vehicle)
        return self


POSITIVE = ("leg_rate", "spacing", "preview_length", "reward_scale", "speed")
NON_NEGATIVE = ("friction", "min_clearance", "failure_penalty")


def make_params(
    criterion: Criterion,
    *,
    vehicle: UGVParams | None = None,
    track: Track | None = None,
    randomisation: UGVRandomisation | None = None,
    dtype: Any = None,
    friction: Numeric = 0.8,
    leg_rate: Numeric = 1.0,
    spacing: Numeric = 0.1,
    start: Numeric | None = None,
    end: Numeric | None = None,
    start_angles: Numeric = (np.pi / 2, np.pi / 2),
    min_clearance: Numeric = 0.02,
    preview_length: Numeric = 2.0,
    preview_noise: Numeric | None = None,
    failure_penalty: Numeric | None = None,
    reward_scale: Numeric = 1.0,
    speed: Numeric = 1.0,
) -> UGVEnvParams:
    """Gather the numbers; see UGVEnvParams for their meaning and units.

    start, end, spacing: waypoints are those of `PostureProblem.along`: by default from so far in
    that the rear wheel stays on the track in every posture to the track's end, and evenly spaced by
    at most `spacing`. failure_penalty: by default `penalty_for` the criterion.
    """
    vehicle = UGVParams() if vehicle is None else vehicle
    track = Track.bump() if track is None else track
    drawn = UGVRandomisation() if randomisation is None else randomisation
    kinds = {"vehicle": (vehicle, UGVParams), "track": (track, Track)}
    for name, (given, kind) in (kinds | {"randomisation": (drawn, UGVRandomisation)}).items():
        if not isinstance(given, kind):
            raise ValueError(f"{name} = {given!r}; accepted: None or a {kind.__name__}")
    places = waypoints_along(track, vehicle, spacing, start, end)
    first, last = float(places[0]), float(places[-1])
    dtype = jnp.dtype(dtype or jnp.result_type(float))
    if failure_penalty is None:
        failure_penalty = penalty_for(criterion, vehicle, friction, last - first)
    params = UGVEnvParams(
        vehicle=vehicle,
        odometer=_odometer(track, first, last, dtype),
        randomisation=drawn,
        friction=friction,
        leg_rate=leg_rate,
        spacing=(last - first) / (len(places) - 1),
        start=first,
        end=last,
        start_angles=np.asarray(start_angles, float),
        min_clearance=min_clearance,
        preview_length=preview_length,
        preview_noise=preview_noise,
        failure_penalty=failure_penalty,
        reward_scale=reward_scale,
        speed=speed,
    )
    return _cast(params.validate(), dtype)


def penalty_for(criterion: Criterion, vehicle: UGVParams, friction: Numeric, length: Numeric):
    """A penalty that makes failing cost more than any drive to the end, in the criterion's unit.

    A wheel that does not slip has |F| <= mu N, both have the same F, and the normal forces add up
    to about the weight W. So |M| < W r (mu <= 2), what the motors put in over the drive stays below
    (1 + mu) W length, a margin of grip below (1 + mu) W, a demand below 1 + mu. The legs' work in
    total_energy has no such bound: the same penalty is then ample, but not proved. Nor has the
    torque's variation: W r built up and let go once a metre stands for it.
    """
    W, r = vehicle.weight, vehicle.wheel_radius
    bounds = {
        "J": (1 + friction) * W * length,
        "N m": W * r,
        "N^2 m": (W * r) ** 2 * length,
        "N": (1 + friction) * W,
        "-": 1 + friction,
    }
    if criterion.unit not in bounds:
        raise ValueError(
            f"failure_penalty = None with {criterion.name!r}, whose unit is {criterion.unit!r}; "
            "accepted: a number >= 0 in that unit"
        )
    return bounds[criterion.unit]


def _odometer(track: Track, start: Numeric, end: Numeric, dtype: Any) -> Odometer:
    """Over the track and the drive, whichever reaches farther."""
    first, last = np.minimum(track.start, start), np.maximum(track.end, end)
    track.require_resolved(dtype)
    return _cast(Odometer.along(track, first, last), dtype)


def _cast(tree: Any, dtype: Any) -> Any:
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), tree)
