"""Parameters of the UGV environment: vehicle, ground, task, reward and randomisation."""

from __future__ import annotations

from dataclasses import field, fields, replace
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import pytrees
from stickslip.dynamics.checks import is_concrete, require_kind, require_known, shown
from stickslip.dynamics.names import RANDOM_TRACKS
from stickslip.dynamics.ugv import Odometer, Track, UGVParams
from stickslip.envs.functional import NON_NEGATIVE, POSITIVE, Rule, as_numbers, require_numbers
from stickslip.envs.ugv.randomisation import (
    UGVRandomisation,
    cast,
    covering,
    ground_of,
    odometer_over,
)
from stickslip.optim.posture.waypoints import waypoints_along

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float, Int, Real

    from stickslip.optim.posture.criteria import Criterion


@pytrees.pytree_dataclass
class UGVEnvParams:
    """Parameters of UGVEnv, a pytree to vmap over. Build it with `UGVEnv.make_params`.

    vehicle: the UGV. odometer: the ground and the arc length along it, made anew where the drive
    leaves what it covers; a drawn ground takes its place. randomisation: what a reset draws.
    friction: mu between wheels and ground [-]. leg_rate: how far action 1 turns a leg for each
    metre that the front wheel advances [rad/m]. spacing: how far it advances in a step [m]. start,
    end: where it stands at first and at last [m]. start_angles: of the legs [2], rear and front
    [rad]. min_clearance: body and legs must be as far above the ground [m]. max_torque: the most
    that each wheel's motor gives, either way [N m], or None: any.
    preview_length: how far ahead the ground is seen [m]. preview_noise: standard deviation of each
    height seen [m], or None for exact ones.
    reward_scale: factor on the whole reward; 1 leaves it in the criterion's unit. speed: of the
    front wheel along x in pictures [m/s]; nothing else knows of time.
    given_penalty: the failure penalty, or None for the one that `penalty_for` makes of vehicle,
    friction (the greatest that is drawn) and way in penalty_unit, the criterion's unit.
    failure_penalty: which of them it is; taken off the reward, once, when the episode terminates.
    """

    vehicle: UGVParams
    odometer: Odometer
    randomisation: UGVRandomisation
    friction: pytrees.Numeric
    leg_rate: pytrees.Numeric
    spacing: pytrees.Numeric
    start: pytrees.Numeric
    end: pytrees.Numeric
    start_angles: pytrees.Numeric
    min_clearance: pytrees.Numeric
    preview_length: pytrees.Numeric
    preview_noise: pytrees.Numeric | None
    max_torque: Real[pytrees.Number, "..."] | None
    reward_scale: pytrees.Numeric
    speed: pytrees.Numeric
    given_penalty: pytrees.Numeric | None
    penalty_unit: str = field(metadata={"static": True})
    failure_penalty: pytrees.Numeric = field(init=False)

    def __post_init__(self):
        penalty, friction = self.given_penalty, self.friction
        if pytrees.holds_numbers(self.vehicle, self.odometer, friction, self.start, self.end):
            pytrees.settle(self, odometer=covering(self.odometer, self.start, self.end))
            if penalty is None:
                if (drawn := self.randomisation.friction) is not None:
                    friction = jnp.maximum(friction, drawn[1])
                surface, ground = self.track.surface, self.randomisation.track
                if surface is not None and surface.measured:
                    friction = jnp.max(surface.factors)
                elif surface is not None:
                    friction = friction * jnp.maximum(jnp.max(jnp.asarray(surface.factors)), 1.0)
                if ground is not None and ground.grip is not None:
                    friction = friction * jnp.maximum(ground.grip[1], 1.0)
                way = self.end - self.start
                penalty = penalty_for(self.penalty_unit, self.vehicle, friction, way)
        pytrees.settle(self, failure_penalty=penalty)

    @property
    def track(self) -> Track:
        """The ground, where none is drawn."""
        return self.odometer.track

    @property
    def steps(self):
        """Steps of a whole episode: the last waypoint is at or less than `spacing` before end,
        or beyond it by what its numbers are rounded."""
        eps = jnp.finfo(jnp.result_type(self.start)).eps
        rounded = 2 * eps * (jnp.abs(self.start) + jnp.abs(self.end)) / self.spacing
        count = (self.end - self.start) / self.spacing
        return jnp.floor(count + 1e-3 + jnp.minimum(rounded, 0.4)).astype(int)

    @property
    def control_period(self):
        """Duration of a step at the speed of the pictures [s]."""
        return self.spacing / self.speed

    @property
    def time_limit(self):
        """Duration of an episode at the speed of the pictures [s]."""
        return self.steps * self.control_period

    def waypoint(self, step: Int[Array, "*n"] | np.ndarray | int) -> Float[Array, "*n"]:
        """Contact of the front wheel after so many steps [m]."""
        return self.start + self.spacing * jnp.asarray(step).astype(jnp.result_type(self.start))

    def waypoints(self) -> np.ndarray:
        """Every place of the front wheel in a whole episode, the start included [m]: float64,
        of the numbers that the environment has, rounded as it rounds them."""
        return np.asarray(self.waypoint(np.arange(int(self.steps) + 1)), np.float64)

    def replace(self, **changes: Any) -> UGVEnvParams:
        """A copy with some entries changed, validated: fields, or `track` (a Track, or a name as in
        `make_params`). The numbers take the type of those before. ValueError for unknown names."""
        hidden = ("given_penalty", "penalty_unit")
        known = [one.name for one in fields(self) if one.init and one.name not in hidden]
        require_known(changes, [*known, "track", "failure_penalty"])
        dtype = jnp.result_type(self.start)
        _require_kinds(**changes)
        changes = as_numbers(changes, GIVEN)
        if "track" in changes:
            track, drawn = changes.pop("track"), changes.get("randomisation", self.randomisation)
            named = isinstance(track, str) and track in RANDOM_TRACKS
            if named and "randomisation" not in changes:
                drawn = replace(drawn, track=None)
            track, changes["randomisation"] = ground_of(track, drawn)
            start, end = (changes.get(name, getattr(self, name)) for name in ("start", "end"))
            changes["odometer"] = odometer_over(track, start, end, dtype)
        if "failure_penalty" in changes:
            changes["given_penalty"] = changes.pop("failure_penalty")
        return cast(replace(self, **changes).validate(), dtype)

    def shortened(self, steps: int) -> UGVEnvParams:
        """The parameters of a drive of so many steps; the failure penalty stays the same."""
        end = self.start + steps * self.spacing
        return self.replace(end=end, failure_penalty=self.failure_penalty)

    def _require_steps(self, dtype: Any) -> None:
        """Raise ValueError where the way is no step, or a waypoint's last digit no small part of
        one; of numbers, also inside a trace of other things."""
        start, end, spacing = map(np.asarray, (self.start, self.end, self.spacing))
        if not np.all((end - start) / spacing + 1e-3 >= 1):
            given = f"start = {self.start}, end = {self.end} with spacing = {self.spacing}"
            raise ValueError(f"{given}; accepted: start + spacing <= end [m]")
        farthest = np.maximum(np.abs(start), np.abs(end))
        digit = np.spacing(farthest.astype(dtype)).astype(np.float64)
        if np.any(digit > COARSEST * spacing.astype(np.float64)):
            raise ValueError(
                f"spacing = {self.spacing} m at x = {float(np.max(farthest)):.9g} m, where "
                f"{np.dtype(dtype).name} has a number every {float(np.max(digit)):.2g} m; "
                f"accepted: x nearer 0, {1 / COARSEST:g} times that as spacing, or dtype=float64"
            )

    def validate(self) -> UGVEnvParams:
        """Return self, or raise ValueError naming the field, the value and the accepted range."""
        _require_kinds(**vars(self))
        self.vehicle.validate()
        kind = jnp.result_type(self.odometer.start)
        own = {name: rule for name, rule in NUMBERS.items() if name != "failure_penalty"}
        require_numbers(self, own, kind)
        if is_concrete(self.start, self.end, self.spacing):
            self._require_steps(kind)
        require_numbers(self, NUMBERS, kind)  # the penalty follows from the others
        self.vehicle.check_leg_angles(self.start_angles, "start_angles")
        self.randomisation.validate(self.vehicle)
        surface = self.track.surface
        if surface is not None and surface.measured and self.randomisation.friction is not None:
            raise ValueError(
                f"randomisation.friction = {shown(self.randomisation.friction)} on a track that "
                "has its own mu; accepted: None"
            )
        return self


COARSEST = 0.1
"""Greatest distance of neighbouring floats at the end of a drive, in parts of `spacing`."""
ANGLES: dict[str, Rule] = {"start_angles": {"accepted": "2 finite angles, rear and front [rad]"}}
PENALTY: Rule = {"low": 0.0, "accepted": "None, or a finite number >= 0"}
NUMBERS: dict[str, Rule] = {
    **dict.fromkeys(("leg_rate", "spacing", "preview_length", "reward_scale", "speed"), POSITIVE),
    **dict.fromkeys(("friction", "min_clearance"), NON_NEGATIVE),
    "failure_penalty": PENALTY,
    "preview_noise": {"low": 0.0, "accepted": "None, or a finite length >= 0 [m]"},
    "max_torque": {"low": 0.0, "strict": True, "accepted": "None, or a finite torque > 0 [N m]"},
    "start": {"accepted": "a finite place [m]"},
    "end": {"accepted": "a finite place [m]"},
}
"""The rule of every number."""
GIVEN = NUMBERS | ANGLES | {"given_penalty": PENALTY}


def _require_kinds(**given: Any) -> None:
    kinds = {"vehicle": UGVParams, "randomisation": UGVRandomisation, "odometer": Odometer}
    for name, kind in kinds.items():
        if name in given:
            require_kind(name, given[name], kind, f"None or a {kind.__name__}")


def make_params(
    criterion: Criterion,
    *,
    vehicle: UGVParams | None = None,
    track: Track | str | None = None,
    randomisation: UGVRandomisation | None = None,
    dtype: DTypeLike | None = None,
    friction: pytrees.Numeric = 0.8,
    leg_rate: pytrees.Numeric = 1.0,
    spacing: pytrees.Numeric = 0.1,
    start: pytrees.Numeric | None = None,
    end: pytrees.Numeric | None = None,
    start_angles: pytrees.Numeric = (np.pi / 2, np.pi / 2),
    min_clearance: pytrees.Numeric = 0.02,
    preview_length: pytrees.Numeric = 2.0,
    preview_noise: pytrees.Numeric | None = None,
    max_torque: Real[pytrees.Number, "..."] | None = None,
    failure_penalty: pytrees.Numeric | None = None,
    reward_scale: pytrees.Numeric = 1.0,
    speed: pytrees.Numeric = 1.0,
) -> UGVEnvParams:
    """Gather the numbers; see UGVEnvParams for their meaning and units.

    track: a Track, one of TRACKS by its name, or one of RANDOM_TRACKS, which randomisation then
    draws. start, end, spacing: waypoints are those of `PostureProblem.along`: by default from so
    far in that the rear wheel stays on the track in every posture to the track's end, and evenly
    spaced by at most `spacing`. failure_penalty: by default `penalty_for` the criterion.
    """
    apart = ("spacing", "start", "end")
    numbers = {name: one for name, one in locals().items() if name in GIVEN and name not in apart}
    vehicle = UGVParams() if vehicle is None else vehicle
    drawn = UGVRandomisation() if randomisation is None else randomisation
    _require_kinds(vehicle=vehicle, randomisation=drawn)
    track, drawn = ground_of("bump" if track is None else track, drawn)
    drawn.validate(vehicle)
    numbers = as_numbers(numbers, GIVEN)
    places = waypoints_along(track, vehicle, spacing, start, end)
    first, last = float(places[0]), float(places[-1])
    dtype = pytrees.float_kind(dtype, jnp.result_type(float))
    params = UGVEnvParams(
        vehicle=vehicle,
        odometer=odometer_over(track, first, last, dtype),
        randomisation=drawn,
        spacing=(last - first) / (len(places) - 1),
        start=first,
        end=last,
        given_penalty=numbers.pop("failure_penalty"),
        penalty_unit=criterion.unit,
        **numbers,
    )
    return cast(params.validate(), dtype)


def penalty_for(unit: str, vehicle: UGVParams, friction: pytrees.Numeric, length: pytrees.Numeric):
    """A penalty that makes failing cost more than any drive to the end, in the criterion's unit.

    A wheel that does not slip has |F| <= mu N, both have the same F, and the normal forces add up
    to about the weight W. So |M| < W r (mu <= 2), what the motors put in over the drive stays below
    (1 + mu) W length, a margin of grip below (1 + mu) W, a demand below 1 + mu. The legs' work in
    total_energy has no such bound: the same penalty is then ample, but not proved. Nor has the
    torque's variation: W r built up and let go once a metre stands for it. Rolling resistance c
    adds c N r to a torque, so c is added to mu, and to 1 in W r; drive_efficiency divides the
    energy. Heat of the legs' actuators is taken of ground forces (1 + mu) W at an arm of l + r.
    """
    W, r = vehicle.weight, vehicle.wheel_radius
    if (c := vehicle.rolling_resistance) is not None:
        friction, r = friction + c, r * (1 + c)
    efficiency = 1.0 if (given := vehicle.drive_efficiency) is None else given
    energy = (1 + friction) * W * length / efficiency
    if (loss := vehicle.holding_loss) is not None:
        energy += loss * ((1 + friction) * W * (vehicle.leg_length + r)) ** 2 * length
    bounds = {
        "J": energy,
        "N m": W * r,
        "N^2 m": (W * r) ** 2 * length,
        "N": (1 + friction) * W,
        "-": 1 + friction,
    }
    if unit not in bounds:
        raise ValueError(
            f"failure_penalty = None with a criterion whose unit is {unit!r}; accepted: a number "
            ">= 0 in that unit"
        )
    return bounds[unit]
