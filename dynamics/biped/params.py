"""Parameters of PASIBOT: lengths, masses, centres and inertias, link by link."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics import checks, pytrees
from stickslip.dynamics.names import BAR_LENGTHS, LENGTHS, range_of

if TYPE_CHECKING:
    from jax.typing import DTypeLike
    from jaxtyping import Array, Float

    from stickslip.dynamics.machine_file import Changes, OwnMachine
    from stickslip.dynamics.pytrees import Scalar

    Either = Array | np.ndarray
    """Array of the module that computes: jax.numpy or numpy."""


NO_NUMBERS = ("cls", "hip_centre", "dtype")
"""The arguments of `from_bars` that are not one number each."""
HIP_CENTRE = ("hip_centre[0]", "hip_centre[1]")


@pytrees.pytree_dataclass
class BipedParams:
    """PASIBOT's geometry and mass, SI units. Build the default set with `from_bars()`.

    Every field may be an array with leading batch axes and be mapped over with vmap. The
    constructor, and with it `dataclasses.replace`, refuses fields of another kind, sign or shape;
    `validate`, `from_bars` and `replace` look at robots as a whole, too.

    Lengths [m], pins named as in the chapter's Fig. 3:
      crank: A to crank pin (each arm). ground_link: A to B, horizontal. rod: C to crank pin.
      rod_pin: crank pin to the rocker's pin on the rod. rocker: that pin to B.
      tendon_drop: B down to D. upper_tendon: D to F. lower_tendon: D to H.
      femur: K to C. femur_pin: C to F. tibia: ankle E to K. tibia_pin: K to H.
      stabiliser: C to the slot pin P. slot_depth: A down to the slot. offset: the parallelograms'
      offset d, forwards, fixed in links 1, 5, 10 (bars 11 and 12 are as long as tibia and femur).
      heel, toe: the foot's edges behind and before the ankle.
    mass [13] kg, inertia [13] kg m^2 about the centre of mass, centre [13, 2] m: centre of mass in
      the link's frame. Links in the order of LINKS. A link's frame has its x axis along the
      chapter's vector for that link and its origin at that vector's tail: foot E, tibia E, femur K,
      lower tendon H, knee link K, upper tendon D, rod C, crank A, rocker its pin on the rod,
      stabiliser C, tibia bar E + d, femur bar K + d, hip A.
    payload: extra mass at the hip's centre [kg]. gravity [m/s^2].
    """

    crank: pytrees.Numeric
    ground_link: pytrees.Numeric
    rod: pytrees.Numeric
    rod_pin: pytrees.Numeric
    rocker: pytrees.Numeric
    tendon_drop: pytrees.Numeric
    upper_tendon: pytrees.Numeric
    lower_tendon: pytrees.Numeric
    femur: pytrees.Numeric
    femur_pin: pytrees.Numeric
    tibia: pytrees.Numeric
    tibia_pin: pytrees.Numeric
    stabiliser: pytrees.Numeric
    slot_depth: pytrees.Numeric
    offset: pytrees.Numeric
    heel: pytrees.Numeric
    toe: pytrees.Numeric
    mass: pytrees.Numeric
    centre: pytrees.Numeric
    inertia: pytrees.Numeric
    payload: pytrees.Numeric
    gravity: pytrees.Numeric

    def __post_init__(self):
        if not all(isinstance(leaf, int) for leaf in jax.tree.leaves(self)):  # axes to map over
            self._check_numbers()

    @classmethod
    def from_bars(
        cls,
        crank_length: pytrees.Numbers = 0.030,
        bar_density: pytrees.Numbers = 1.48,
        hip_mass: pytrees.Numbers = 0.70,
        foot_mass: pytrees.Numbers = 0.30,
        foot_inertia: pytrees.Numbers = 1e-3,
        offset: pytrees.Numbers = 2.0,
        payload: pytrees.Numbers = 0.0,
        heel: pytrees.Numbers = 8.0,
        toe: pytrees.Numbers = 8.0,
        gravity: pytrees.Numbers = 9.81,
        *,
        ground_link: pytrees.Numbers = 2.0,
        rod: pytrees.Numbers = 5.0,
        rod_pin: pytrees.Numbers = 2.5,
        rocker: pytrees.Numbers = 2.5,
        tendon_drop: pytrees.Numbers = 12.0,
        upper_tendon: pytrees.Numbers = 6.0,
        lower_tendon: pytrees.Numbers = 6.0,
        femur: pytrees.Numbers = 9.0,
        femur_pin: pytrees.Numbers = 3.0,
        tibia: pytrees.Numbers = 18.0,
        tibia_pin: pytrees.Numbers = 6.0,
        stabiliser: pytrees.Numbers = 4.2,
        slot_depth: pytrees.Numbers = 4.0,
        hip_centre: Sequence[pytrees.Number] = (1.0, -6.0),
        hip_span: pytrees.Numbers = 16.0,
        dtype: DTypeLike | None = None,
    ) -> BipedParams:
        """Uniform bars of one density, a hip and two feet; the defaults are the reference robot.

        crank_length [m], bar_density [kg/m], masses [kg], foot_inertia [kg m^2], gravity [m/s^2];
        every other length (offset, heel, toe, hip_centre, hip_span) in crank lengths. Bars have
        their centre in the middle and I = m L^2 / 12, the hip I = m hip_span^2 / 12; the double
        crank is 2 crank lengths long; the foot's centre is the ankle. The chapter prints the
        lengths but no masses: bar_density and hip_mass are calibrated on its start torque (0.84 N
        m) and least friction (0.08 at 3 rad/s). dtype: of all numbers, by default JAX's own; a
        robot made in float32 keeps its 7 digits in a float64 walk. ValueError: see `validate`.
        """
        numbers = {name: one for name, one in locals().items() if name not in NO_NUMBERS}
        pair = isinstance(hip_centre, list | tuple) and len(hip_centre) == 2
        pair = pair and not any(isinstance(part, list | tuple) for part in hip_centre)
        checks.require_that(pair, "hip_centre", hip_centre, "a pair of finite numbers")
        numbers |= dict(zip(HIP_CENTRE, hip_centre, strict=True))
        kind = _checked(numbers, dtype)
        xp = np if checks.is_concrete(numbers) else jnp
        arrays = {name: xp.asarray(value, kind) for name, value in numbers.items()}
        unit = arrays["crank_length"]
        lengths = {name: xp.asarray(unit * arrays[name]) for name in LENGTHS if name != "crank"}
        lengths["crank"] = unit
        links = _links(xp, lengths, arrays)
        rest = {"payload": arrays["payload"], "gravity": arrays["gravity"]}
        return cls(**lengths, **links, **rest).astype(kind)._checked_whole()

    @classmethod
    def from_file(cls, path: str | Path | None, changes: Changes | None = None) -> BipedParams:
        """The robot of a TOML file, every entry optional; the reference robot is the default.

        Numbers are in SI units, or texts with their units, as "40 mm". Tables: `bars`, the
        arguments of `from_bars` (numbers in crank lengths there stay so, "360 mm" is a length);
        `lengths`, the fields that are lengths, in place of the bars'; `links.NAME` with mass,
        centre [x, y] and inertia, in place of the bar's, NAME as in LINKS with underscores;
        `payload` and `gravity` outside of tables; `motor`, which the commands read.
        path: None for the reference robot. changes: single numbers by dotted names, as
        {"robot.hip_mass": 1.2}, see `changed`. ValueError naming the file, the entry, the value
        and what is accepted.
        """
        return cls.with_motor(path, changes).params

    @classmethod
    def with_motor(cls, path: str | Path | None, changes: Changes | None = None) -> OwnMachine:
        """The robot of `from_file`, and the numbers in the file's table `motor`."""
        from stickslip.dynamics.biped.robot_file import read_robot

        return read_robot(cls, path, changes or {})

    def changed(self, changes: Mapping[str, pytrees.Numeric]) -> BipedParams:
        """A copy with some numbers changed, by the names of `--set` and of a sweep's axes.

        changes: of `stickslip.dynamics.biped.robot_file.ROBOT`, as {"robot.crank_length": 0.04,
        "robot.mass.hip": 2.0}; they may be traced. Arguments of `from_bars` change the lengths and
        the links that are uniform bars; others keep their numbers. ValueError for an unknown name.
        """
        from stickslip.dynamics.biped.robot_file import changed_robot

        return changed_robot(self, changes)

    def to_file(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write the robot link by link as TOML, whole or not at all; return the path.

        `from_file` reads the same numbers in the same precision. ValueError for a batch of robots,
        and where the file exists unless it may be replaced.
        """
        from stickslip.dynamics.biped.robot_file import robot_text
        from stickslip.records.files import write_whole

        return write_whole(path, robot_text(vars(self.validate())), overwrite=overwrite)

    @property
    def total_mass(self) -> jax.Array:
        """All 24 bodies and the payload [kg]: hip and crank once, every other link twice."""
        mass = jnp.asarray(self.mass)
        return 2 * mass.sum(-1) - mass[..., 7] - mass[..., 12] + self.payload

    def astype(self, dtype: DTypeLike) -> BipedParams:
        """The same robot with every field as an array of `dtype`."""
        return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype), self)

    def replace(self, **changes: pytrees.Numbers) -> BipedParams:
        """A copy with some fields changed, validated. ValueError for an unknown field."""
        checks.require_known(changes, vars(self))
        numbers = {k: checks.as_number(k, v, accepted="finite numbers") for k, v in changes.items()}
        return replace(self, **numbers)._checked_whole()

    def validate(self) -> BipedParams:
        """Return self, or raise ValueError naming the field, the value and the accepted range.

        Checks shapes, signs, finiteness, and that the linkage closes at every crank angle (the
        message says where it does not). Traced values pass unchecked: inside a transformation a
        linkage that cannot close is reported as Status.NO_SOLUTION.
        """
        self._check_numbers()
        return self._checked_whole()

    def _checked_whole(self) -> BipedParams:
        """Self, or ValueError: what no field shows by itself, of numbers that were looked at."""
        if checks.is_concrete(self.mass, self.payload):
            # Hip and crank twice, too: above 0 and finite where the whole mass is.
            whole = 2 * np.asarray(self.mass).sum(-1) + np.asarray(self.payload)
            accepted = "a finite mass > 0 [kg]"
            checks.require_number("total mass", whole, low=0.0, strict=True, accepted=accepted)
        if checks.is_concrete(self):
            from stickslip.dynamics.biped.links import require_closure

            require_closure(self)
        return self

    def _check_numbers(self):
        pytrees.require_numeric(**vars(self))
        for name, tail in (("mass", (13,)), ("inertia", (13,)), ("centre", (13, 2))):
            shape = np.shape(getattr(self, name))
            if shape[max(len(shape) - len(tail), 0) :] != tail:
                raise ValueError(f"{name} has shape {shape}; accepted: {tail}, in LINKS' order")
        for name, value in vars(self).items():
            checks.require_number(name, value, **range_of(name))


def own_time(params: BipedParams) -> Scalar:
    """The robot's own unit of time, sqrt(crank / gravity) [s]: 55.3 ms for the default one.

    Robots of any size with the same ratios of lengths and of masses walk alike in it, under torques
    in proportion to weight times crank.
    """
    return jnp.sqrt(jnp.asarray(params.crank) / jnp.asarray(params.gravity))


def _checked(numbers: dict[str, pytrees.Numeric], dtype: Any):
    """The floating type of a robot with these numbers, or ValueError for one of them."""
    for name, value in numbers.items():
        checks.require_number(name, value, **range_of(name))
    kinds = (jnp.result_type(v) for v in numbers.values() if not isinstance(v, list | tuple))
    dtype = pytrees.float_kind(dtype, jnp.result_type(float, *kinds))
    for name, value in numbers.items():
        checks.require_number(name, value, **range_of(name), dtype=dtype)
    pytrees.require_broadcast(**numbers)
    return dtype


def _links(
    xp: ModuleType,
    lengths: Mapping[str, Float[Either, "*batch"]],
    numbers: Mapping[str, Float[Either, "*batch"]],
) -> dict[str, Either]:
    """mass, centre and inertia of feet, uniform bars and hip, as BipedParams has them.

    xp: jax.numpy, or numpy where the numbers are at hand: with it nothing is compiled. lengths [m],
    by the names of BAR_LENGTHS; numbers: the arguments of `from_bars`.
    """
    sides = [2 * lengths[name] if name == "crank" else lengths[name] for name in BAR_LENGTHS]
    length = xp.stack(xp.broadcast_arrays(*sides), axis=-1)
    mass = numbers["bar_density"][..., None] * length
    middle = xp.where(np.arange(len(BAR_LENGTHS)) == BAR_LENGTHS.index("crank"), 0.0, length) / 2
    unit, ankle = lengths["crank"], xp.zeros_like(lengths["crank"])
    ahead, above = (xp.asarray(unit * numbers[name]) for name in HIP_CENTRE)
    along = _join(xp, ankle, middle, ahead)
    across = _join(xp, ankle, xp.zeros_like(middle), above)
    span = xp.asarray(unit * numbers["hip_span"])
    hip_inertia = xp.asarray(numbers["hip_mass"] * span**2 / 12)
    return {
        "mass": _join(xp, numbers["foot_mass"], mass, numbers["hip_mass"]),
        "centre": xp.stack([along, across], axis=-1),
        "inertia": _join(xp, numbers["foot_inertia"], mass * length**2 / 12, hip_inertia),
    }


def _join(xp: ModuleType, foot: Either, bars: Either, hip: Either) -> Either:
    """Foot, the eleven bars and hip along the last axis, batch axes broadcast."""
    batch = np.broadcast_shapes(foot.shape, bars.shape[:-1], hip.shape)
    parts = [foot[..., None], bars, hip[..., None]]
    return xp.concatenate(
        [xp.broadcast_to(part, (*batch, part.shape[-1])) for part in parts], axis=-1
    )
