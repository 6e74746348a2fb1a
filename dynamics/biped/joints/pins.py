"""The pin table of MODEL 1.1 as data: which two bodies every joint joins, and where.

A joint force acts on body `on` and comes from body `by`; the reverse acts on `by` (Newton's third
law, first lines of eq. 18). Pins take both components in ground axes, slots one normal to the slot.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped.links import BODIES, LegPins

if TYPE_CHECKING:
    from jaxtyping import Array, Float

LEG_LINKS = (1, 2, 3, 4, 5, 6, 7, 9, 10, 11, 12)
"""The 11 links that each leg has of its own."""

LEG_PINS = (
    (1, 2, "E"),
    (1, 11, "ankle_bar"),
    (2, 3, "K"),
    (2, 5, "K"),
    (5, 11, "knee_bar"),
    (5, 12, "knee_bar"),
    (10, 12, "C_bar"),
    (7, 3, "C"),
    (7, 10, "C"),
    (3, 6, "F"),
    (6, 13, "D"),
    (4, 13, "D"),
    (4, 2, "H"),
    (7, 8, "crank_pin"),
    (7, 9, "rod_pin"),
    (9, 13, "B"),
)
"""Per leg: link `on`, link `by`, and the pin: a field of LegPins, or the hip's B or D."""

LEG_SLOT = (10, 13, "slot_pin")
"""The stabiliser's pin P in the hip's slot, which is parallel to A B."""

CRANK_PIN = (8, 13, "A")
"""The motor's axis."""

GROUPS = ((1, 11), (5, 12), (10,), (2, 4), (3, 6), (7, 9))
"""A leg's Assur groups from the foot to the crank: each one's joint forces follow from those of the
groups before it. A pair has a pin between its links and one to the rest of the robot on each; the
stabiliser has a pin and the slot."""

_HIP_PINS = ("A", "B", "D")
_PER_LEG = 2 * len(LEG_PINS) + 1


class Joint(NamedTuple):
    """One column of the Newton-Euler system: a component of a joint's force."""

    on: int
    """Index in BODIES of the body that the force acts on."""
    by: int
    """Index in BODIES of the body that it comes from."""
    place: str
    """Field of LegPins, or A, B, D."""
    leg: int
    """0 for the supporting leg, 1 for the other; 0 for the motor's axis."""
    axis: str
    """"x", "y" or "normal"."""


def body_of(link: int, leg: int) -> int:
    """Index in BODIES of link number `link` of leg 0 (supporting) or 1; crank and hip: either."""
    return BODIES.index(str(link) if leg == 0 or link in (8, 13) else f"{link}p")


def _columns():
    for leg in (0, 1):
        for on, by, place in LEG_PINS:
            for axis in "xy":
                yield Joint(body_of(on, leg), body_of(by, leg), place, leg, axis)
        on, by, place = LEG_SLOT
        yield Joint(body_of(on, leg), body_of(by, leg), place, leg, "normal")
    on, by, place = CRANK_PIN
    for axis in "xy":
        yield Joint(body_of(on, 0), body_of(by, 0), place, 0, axis)


JOINTS: tuple[Joint, ...] = tuple(_columns())
"""The 68 components: supporting leg (16 pins, slot), other leg (the same), motor's axis."""

JOINT_FORCES: tuple[tuple[str, str, str], ...] = tuple(
    (BODIES[joint.on], BODIES[joint.by], joint.axis) for joint in JOINTS
)
"""Names of the 68 components: force on body `on` by body `by`, and the axis. x and y are ground
axes; "normal" is along the slot's normal, A B turned by +90 degrees (upwards, but for the hip's
tilt of a tenth of a degree)."""


def _signs() -> np.ndarray:
    signs = np.zeros((len(BODIES), len(JOINTS)))
    for column, joint in enumerate(JOINTS):
        signs[joint.on, column] += 1
        signs[joint.by, column] -= 1
    return signs


SIGNS: np.ndarray = _signs()
"""[24, 68]: +1 for the body that a component acts on, -1 for the one that it comes from."""


def pin_columns(on: int, by: int) -> slice:
    """Columns of a pin or slot, named by its link numbers, among the 33 of a leg."""
    for pin, (first, second, _) in enumerate(LEG_PINS):
        if (first, second) == (on, by):
            return slice(2 * pin, 2 * pin + 2)
    if (on, by) == LEG_SLOT[:2]:
        return slice(_PER_LEG - 1, _PER_LEG)
    known = ", ".join(f"{a}-{b}" for a, b, _ in (*LEG_PINS, LEG_SLOT))
    raise ValueError(f"a leg has no joint {on}-{by}; accepted: {known}")


def place_of(pins: LegPins, hip_pins: Float[Array, "3 2"], place: str) -> Float[Array, "2 2"]:
    """Position of a pin in each leg [m], ground frame; the hip's pins are the same twice."""
    if place in _HIP_PINS:
        point = hip_pins[_HIP_PINS.index(place)]
        return jnp.stack([point, point])
    return getattr(pins, place)


def slot_normal(hip_pins: Float[Array, "3 2"]) -> Float[Array, " 2"]:
    """Unit normal of the slot: A B turned by +90 degrees, ground frame."""
    along = hip_pins[1] - hip_pins[0]
    return jnp.stack([-along[1], along[0]]) / jnp.sqrt(along @ along)


def joint_geometry(
    pins: LegPins, hip_pins: Float[Array, "3 2"]
) -> tuple[Float[Array, "68 2"], Float[Array, "68 2"]]:
    """Point [m] at which each of the 68 components acts, and its unit direction; ground frame."""
    points = jnp.concatenate([*pins, hip_pins])
    names = [(field, leg) for field in LegPins._fields for leg in (0, 1)]
    names += [(name, 0) for name in _HIP_PINS]
    index = [
        names.index((joint.place, 0 if joint.place in _HIP_PINS else joint.leg)) for joint in JOINTS
    ]
    normal = slot_normal(hip_pins)
    zero, one = jnp.zeros_like(normal[0]), jnp.ones_like(normal[0])
    axes = jnp.stack([jnp.stack([one, zero]), jnp.stack([zero, one]), normal])
    kinds = [("x", "y", "normal").index(joint.axis) for joint in JOINTS]
    return points[np.array(index, np.int32)], axes[np.array(kinds, np.int32)]
