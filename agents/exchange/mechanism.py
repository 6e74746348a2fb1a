"""The biped as a tree of bodies with open loops: masses, places, and the joints of a pose.

The tree hangs on the foot of the first leg and goes through its tibia and lower tendon to the hip,
from there to everything else. The stabilisers slide along the hip and turn, so 12 pins are left to
close, and 26 coordinates keep one degree of freedom beside the foot's own. Every frame is parallel
to the ground's where all joints are 0, at the crank angle SUPPORT_START.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BODIES, SUPPORT_START, Kinematics, kinematics
from stickslip.dynamics.biped.links import LINK_OF_BODY
from stickslip.dynamics.biped.robot_file import NAMES

if TYPE_CHECKING:
    from jaxtyping import Array, Float

    from stickslip.dynamics.biped import BipedParams
    from stickslip.dynamics.pytrees import Scalar

SLOT = "slot_pin"
FEET = ("1", "1p")

_THIGH = (("2", "1", "E"), ("3", "2", "K"), ("7", "3", "C"))
_HIP = (("4", "2", "H"), ("13", "4", "D"), ("8", "13", "A"), ("6", "13", "D"), ("9", "13", "B"))
_HIP += (("10", "13", SLOT), ("6p", "13", "D"), ("9p", "13", "B"), ("10p", "13", SLOT))
_SWING = (("4p", "13", "D"), ("2p", "4p", "H"), ("3p", "2p", "K"), ("7p", "3p", "C"))
_SWING += (("1p", "2p", "E"), ("11p", "1p", "ankle_bar"), ("5p", "11p", "knee_bar"))
_SWING += (("12p", "5p", "knee_bar"),)
_BARS = (("11", "1", "ankle_bar"), ("5", "11", "knee_bar"), ("12", "5", "knee_bar"))

TREE: tuple[tuple[str, str, str], ...] = (*_THIGH, *_HIP, *_SWING, *_BARS)
"""(body, the body it hangs on, the pin between them), depth first; the root is body 1."""

_OPEN = (("2", "5", "K"), ("10", "12", "C_bar"), ("7", "10", "C"), ("3", "6", "F"))
_OPEN += (("7", "8", "crank_pin"), ("7", "9", "rod_pin"))
_OTHER = [(f"{one}p", "8" if other == "8" else f"{other}p", pin) for one, other, pin in _OPEN]
LOOPS: tuple[tuple[str, str, str], ...] = (*_OPEN, *_OTHER)
"""(body, body, pin) that the tree leaves open: six pins a leg."""


def name_of(body: str) -> str:
    """Name in files: `tibia` of body 2, `tibia_p` of the second leg's."""
    return NAMES[int(body.rstrip("p")) - 1] + ("_p" if body.endswith("p") else "")


class Mechanism(NamedTuple):
    """Masses and places of the 24 bodies at the crank angle SUPPORT_START, where both feet are on
    the floor; ground frame, SI units."""

    mass: Float[Array, " 24"]
    """In the order of BODIES, the payload in the hip's [kg]."""
    inertia: Float[Array, " 24"]
    """About the centres of mass [kg m^2]."""
    placed: Kinematics
    crank: Scalar
    """Length of the crank [m]."""
    heel: Scalar
    toe: Scalar
    gravity: Scalar

    def pin(self, name: str, body: str) -> np.ndarray:
        """Place [2] of the pin `name` of the leg that `body` belongs to."""
        if name in "ABD":
            return np.asarray(self.placed.hip_pins["ABD".index(name)], float)
        return np.asarray(getattr(self.placed.pins, name)[int(body.endswith("p"))], float)

    def pins_of(self, body: str) -> list[np.ndarray]:
        """Different places [2] of a body's pins."""
        pins = (self.pin(pin, one) for one, other, pin in TREE + LOOPS if body in (one, other))
        return list({tuple(place): place for place in pins}.values())

    def soles(self, foot: str) -> list[np.ndarray]:
        """Centres [2] of the balls at heel and toe in a foot's frame."""
        angle = float(self.placed.angles[BODIES.index(foot)])
        along, up = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        edges = -float(self.heel), float(self.toe)
        return [edge * along + self.sole_radius * up for edge in edges]

    @property
    def sole_radius(self) -> float:
        """Of the balls by which a foot touches the floor [m]."""
        return float(self.crank) * 2 / 3

    @property
    def thickness(self) -> float:
        """Radius of drawn bars [m]."""
        return float(self.crank) / 5

    @property
    def slot(self) -> np.ndarray:
        """Direction of the hip's slot [2]."""
        along = self.pin("B", "13") - self.pin("A", "13")
        return along / np.linalg.norm(along)


def mechanism(params: BipedParams) -> Mechanism:
    """The robot with its payload; traced or not."""
    mass = jnp.asarray(params.mass)[LINK_OF_BODY].at[BODIES.index("13")].add(params.payload)
    inertia = jnp.asarray(params.inertia)[LINK_OF_BODY]
    placed = _placed(params, jnp.asarray(SUPPORT_START, mass.dtype))
    lengths = params.crank, params.heel, params.toe
    return Mechanism(mass, inertia, placed, *lengths, params.gravity)


_placed = jax.jit(kinematics)


def joints(
    params: BipedParams, theta: Scalar, rate: Scalar
) -> tuple[Float[Array, " 25"], Float[Array, " 25"]]:
    """Positions and velocities of the tree's joints while the first foot rests, in TREE's order.

    A slot has two: its slide [m], then its turn. All are 0 at the crank angle SUPPORT_START.
    """
    start = kinematics(params, jnp.asarray(SUPPORT_START, theta.dtype))

    def positions(theta: Scalar) -> Float[Array, " 25"]:
        now, found = kinematics(params, theta), []
        turned = dict(zip(BODIES, now.angles - start.angles, strict=True))
        for body, parent, pin in TREE:
            if pin == SLOT:
                leg = int(body.endswith("p"))
                found.append(_slide(now)[leg] - _slide(start)[leg])
            turn = turned[body] - turned[parent]
            turn = (turn + np.pi) % (2 * np.pi) - np.pi
            found.append(theta - SUPPORT_START if body == "8" else turn)
        return jnp.stack(found)

    return jax.jvp(positions, (theta,), (rate,))


def _slide(placed: Kinematics) -> Float[Array, " 2"]:
    """Place of both slot pins along the slot [m]."""
    a, b, _ = placed.hip_pins
    along = b - a
    return (placed.pins.slot_pin - a) @ along / jnp.linalg.norm(along)
