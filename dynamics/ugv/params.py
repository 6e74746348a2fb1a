"""Parameters of the UGV: a half vehicle of a body, two legs and two driven wheels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import eval_context

from stickslip.dynamics import checks, pytrees
from stickslip.dynamics.machine_file import MachineFile, OwnMachine, in_file, table_of, toml_text

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.machine_file import Changes
    from stickslip.dynamics.ugv.ground.shapes import Points


NUMBERS = (int, float, np.number, np.ndarray, jax.Array)
POSITIVE: dict[str, Any] = {"low": 0.0, "strict": True, "accepted": "numbers > 0"}
MASS: dict[str, Any] = {"low": 0.0, "accepted": "numbers >= 0, not all 0"}
ANGLE: dict[str, Any] = {"low": 0.0, "accepted": "angles from 0 to pi [rad]"}
RULES: dict[str, dict[str, Any]] = {"wheel_gap": {"low": 0.0, "accepted": "lengths >= 0 [m]"}}
"""Accepted range of each field."""
RULES |= dict.fromkeys(("body_length", "leg_length", "wheel_radius", "gravity"), POSITIVE)
RULES |= dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), MASS)
RULES |= dict.fromkeys(("leg_angle_min", "leg_angle_max"), ANGLE)
OPTIONAL: dict[str, dict[str, Any]] = {
    "rolling_resistance": {"low": 0.0, "accepted": "None, or a number >= 0 [-]"},
    "drive_efficiency": POSITIVE | {"high": 1.0, "accepted": "None, or above 0, up to 1 [-]"},
    "regeneration_efficiency": {"low": 0.0, "high": 1.0, "accepted": "None, or 0 to 1 [-]"},
    "holding_loss": {"low": 0.0, "accepted": "None, or a number >= 0 [J/(N m)^2/m]"},
}
"""The same of the fields that may be None."""


@pytrees.pytree_dataclass
class UGVParams:
    """The half vehicle of the chapter's Fig. 20, SI units; masses of one side.

    body_length: hinge to hinge, L [m]. leg_length: hinge to wheel centre, l [m]. wheel_radius: r
    [m]. wheel_mass, leg_mass: of each wheel and each leg; body_mass [kg]. gravity [m/s^2].
    leg_angle_min, leg_angle_max: range of both leg angles [rad], 90 degrees straight down, more is
    outwards. wheel_gap: least distance of the wheels' rims [m]. Centres of mass are at the middles.
    L, l and the masses are the chapter's; radius, range and centres are not in it (MODEL 2).

    None, the default, leaves these out of the compiled program. rolling_resistance: coefficient c
    of the moment c N r against a wheel that rolls forwards (see `ground_forces`) [-].
    drive_efficiency: work of the wheels' motors by the electrical energy that it takes [-];
    regeneration_efficiency: energy recovered by the work that a braking motor takes up [-].
    holding_loss: heat of a leg's actuator on each metre by its torque squared [J/(N m)^2/m].

    Every field may be an array with leading batch axes and be mapped over with vmap.
    """

    body_length: pytrees.Numeric = 0.83
    leg_length: pytrees.Numeric = 0.35
    wheel_radius: pytrees.Numeric = 0.28
    wheel_mass: pytrees.Numeric = 50.0
    body_mass: pytrees.Numeric = 300.0
    leg_mass: pytrees.Numeric = 20.0
    gravity: pytrees.Numeric = 9.81
    leg_angle_min: pytrees.Numeric = np.pi / 6
    leg_angle_max: pytrees.Numeric = 5 * np.pi / 6
    wheel_gap: pytrees.Numeric = 0.0
    rolling_resistance: pytrees.Numeric | None = None
    drive_efficiency: pytrees.Numeric | None = None
    regeneration_efficiency: pytrees.Numeric | None = None
    holding_loss: pytrees.Numeric | None = None

    def __post_init__(self):
        if any(value is not None for value in vars(self).values()):  # else: axes to map over
            for name, rule in self._rules.items():
                pytrees.settle(self, **{name: checks.as_number(name, getattr(self, name), **rule)})
            self.validate()

    @property
    def _rules(self) -> dict[str, dict[str, Any]]:
        """Rules of all fields but the optional ones that are None."""
        given = {name: rule for name, rule in OPTIONAL.items() if getattr(self, name) is not None}
        return RULES | given

    def replace(self, **changes: pytrees.Numbers) -> UGVParams:
        """A copy with some fields changed, validated. ValueError for an unknown field."""
        checks.require_known(changes, vars(self))
        return replace(self, **changes)

    @classmethod
    def from_file(cls, path: str | Path | None, changes: Changes | None = None) -> UGVParams:
        """The vehicle of a TOML file: its table `vehicle` has the fields, all optional.

        Numbers are in SI units, or texts with units, as "830 mm" or "30 deg". The table `motor` is
        for the commands. path: None for the default vehicle. changes: single numbers by dotted
        names, as {"vehicle.leg_mass": 25}. ValueError naming file, entry and what is accepted.
        """
        return cls.with_motor(path, changes).params

    @classmethod
    def with_motor(cls, path: str | Path | None, changes: Changes | None = None) -> OwnMachine:
        """The vehicle of `from_file`, and max_torque [N m] where the file limits its motors."""
        numbers = VEHICLE.read(path, changes or {})
        with in_file(path):
            vehicle = cls(**table_of(numbers, "vehicle"))
            limit = max_torque_of(numbers, float(vehicle.wheel_radius))
        return OwnMachine(vehicle, {} if limit is None else {"max_torque": limit})

    def to_file(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the vehicle as TOML, whole or not at all; return the path.

        ValueError for a batch of vehicles, and where the file exists unless it may be replaced.
        """
        from stickslip.records.files import write_whole

        return write_whole(path, vehicle_text(vars(self)), overwrite=overwrite)

    @property
    def weight(self) -> pytrees.Numeric:
        """Weight of the whole half vehicle [N]."""
        return (2 * self.wheel_mass + 2 * self.leg_mass + self.body_mass) * self.gravity

    def validate(self) -> UGVParams:
        """Return self, or raise ValueError naming the field, the value and the accepted range."""
        for name, rule in self._rules.items():
            checks.require_kind(name, getattr(self, name), NUMBERS, "a number, or an array of them")
            checks.require_number(name, getattr(self, name), **rule)
        pytrees.require_broadcast(**vars(self))
        if checks.is_concrete(self):
            with eval_context():  # numbers, also inside a trace of other things
                self._check_together()
        return self

    def _check_together(self):
        if np.any(np.asarray(self.weight) <= 0):
            raise ValueError("wheel_mass, body_mass and leg_mass are all 0; accepted: one > 0")
        low, high = np.asarray(self.leg_angle_min), np.asarray(self.leg_angle_max)
        if np.any(low > high) or np.any(high > np.pi):
            given = f"leg_angle_min = {low}, leg_angle_max = {high} is not accepted"
            raise ValueError(f"{given}; accepted: 0 <= leg_angle_min <= leg_angle_max <= pi [rad]")
        folded = 2 * np.asarray(self.leg_length) * np.cos(low)
        if np.any(np.asarray(self.body_length) <= folded):
            raise ValueError(
                f"body_length = {self.body_length} is not accepted; accepted: more than the legs "
                f"folded to leg_angle_min take, 2 leg_length cos(leg_angle_min) = {folded} m"
            )

    def check_leg_angles(self, leg_angles: Any, name: str = "leg_angles") -> None:
        """Raise ValueError unless `leg_angles` [..., 2] lie in the range; traced ones pass."""
        checks.require_number(name, leg_angles, accepted="finite angles [..., 2] [rad]")
        if np.shape(leg_angles)[-1:] != (2,):
            raise ValueError(
                f"{name} has shape {np.shape(leg_angles)}; accepted: [..., 2], rear and front"
            )
        if not checks.is_concrete(leg_angles, self):
            return
        values = np.asarray(leg_angles, dtype=float)
        # A range is given in one precision and angles in another: a rounding outside is inside.
        slack = 1e-6
        low = np.expand_dims(np.asarray(self.leg_angle_min, dtype=float), -1)
        high = np.expand_dims(np.asarray(self.leg_angle_max, dtype=float), -1)
        good = (values >= low - slack) & (values <= high + slack)
        if not np.all(good):
            raise ValueError(
                f"{name} = {float(values[~good].flat[0]):.6g} rad is not accepted; accepted: "
                f"{float(np.min(low)):.6g} to {float(np.max(high)):.6g} rad "
                "(leg_angle_min to leg_angle_max)"
            )


def legs(
    params: UGVParams, leg_angles: Float[Array | np.ndarray, "... 2"]
) -> tuple[Points, Points]:
    """Wheel centres in the body's frame (MODEL 2): rear and front, [..., 2] each [m].

    The frame has its origin at the rear hinge and x along the body; leg_angles [..., 2] [rad].
    """
    rear, front = leg_angles[..., 0], leg_angles[..., 1]
    l, L = params.leg_length, params.body_length
    return (
        jnp.stack([l * jnp.cos(rear), -l * jnp.sin(rear)], -1),
        jnp.stack([L - l * jnp.cos(front), -l * jnp.sin(front)], -1),
    )


UNITS = dict.fromkeys(("body_length", "leg_length", "wheel_radius"), "m")
UNITS |= dict.fromkeys(("wheel_mass", "body_mass", "leg_mass"), "kg")
UNITS |= {"gravity": "m/s^2", "leg_angle_min": "rad", "leg_angle_max": "rad", "wheel_gap": "m"}
UNITS |= {"rolling_resistance": "", "drive_efficiency": "", "regeneration_efficiency": ""}
UNITS |= {"holding_loss": "J/(N m)^2/m"}
"""SI units of the fields of UGVParams."""
MOTOR = {"motor.torque_limit": "N m", "motor.max_power": "W", "motor.speed": "m/s"}
ENTRIES = {f"vehicle.{name}": unit for name, unit in UNITS.items()} | MOTOR
VEHICLE = MachineFile("ugv", "vehicle", ENTRIES, {name: name for name in ENTRIES}, {})
"""What the file of a vehicle may have."""
ABOUT = 'A vehicle: numbers in SI units, or texts with their units, as "830 mm".'


def max_torque_of(numbers: Mapping[str, Any], wheel_radius: float) -> float | None:
    """Torque limit of each wheel's motor [N m], None without any, from the numbers of a file.

    Of max_power P it is P r / speed, the torque at which a wheel that rolls at that speed needs P.
    Neglected: that a wheel rolls faster or slower while its leg swings.
    """
    limits = [one for one in [numbers.get("motor.torque_limit")] if one is not None]
    power, speed = numbers.get("motor.max_power"), numbers.get("motor.speed")
    checks.require_both(**{"motor.max_power": power, "motor.speed": speed})
    if power is not None and speed is not None:
        how: dict[str, Any] = {"low": 0.0, "strict": True, "accepted": "a finite number > 0"}
        power = pytrees.require_one("motor.max_power", power, **how)
        limits.append(power * wheel_radius / pytrees.require_one("motor.speed", speed, **how))
    return min(limits, default=None)


def vehicle_text(vehicle: Mapping[str, Any], max_torque: float | None = None) -> str:
    """A vehicle's fields but for those that are None as TOML, max_torque [N m] as its motors'.

    ValueError for a batch.
    """
    for name in UNITS:
        if shape := np.shape(vehicle[name]):
            raise ValueError(f"{name} has shape {shape}; accepted: one vehicle, shape ()")
    numbers = {f"vehicle.{name}": one for name in UNITS if (one := vehicle[name]) is not None}
    numbers |= {} if max_torque is None else {"motor.torque_limit": max_torque}
    return toml_text("ugv", numbers, ABOUT)
