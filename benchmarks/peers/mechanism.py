"""PASIBOT as other programs want it: a tree of bodies with some pins left open, to be closed.

The tree hangs on the supporting foot and goes through its tibia and lower tendon to the hip, from
there to everything else. The slots are joints of the tree (the stabiliser slides along the hip and
turns), so 12 pins are left to close and the 26 coordinates keep one degree of freedom beside the
foot's own.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from stickslip.dynamics.biped import BODIES, BipedParams, kinematics
from stickslip.dynamics.biped.links import LINK_OF_BODY

SLOT = "slot"

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


def _swing(body: str) -> str:
    return body if body == "8" else body + "p"


LOOPS: tuple[tuple[str, str, str], ...] = (
    *_OPEN,
    *((_swing(one), _swing(other), pin) for one, other, pin in _OPEN),
)
"""(body, body, pin) that the tree leaves open: six pins a leg."""


@dataclass(frozen=True)
class Mechanism:
    """Masses and places of everything at one crank angle; ground frame, SI units.

    mass [24], inertia [24] about the centres, centre [24, 2]: bodies in the order of BODIES, the
    payload added to the hip. slot: direction of the hip's slot [2]. heel, toe: the foot's edges
    behind and before the ankle, which is the origin.
    """

    crank_angle: float
    mass: np.ndarray
    inertia: np.ndarray
    centre: np.ndarray
    pins: dict[str, np.ndarray]
    """By name: [2 legs, 2] for the legs' pins, [2] for A, B, D."""
    slot: np.ndarray
    total_mass: float
    gravity: float
    heel: float
    toe: float

    def pin(self, name: str, body: str) -> np.ndarray:
        """Place [2] of the pin `name` of the leg that `body` belongs to."""
        place = self.pins["slot_pin" if name == SLOT else name]
        return place if place.ndim == 1 else place[int(body.endswith("p"))]


def mechanism(params: BipedParams, crank_angle: float = np.pi / 2) -> Mechanism:
    """The bodies and pins of `params` at `crank_angle` [rad], from `kinematics`.

    As exact as the working precision: use 64 bits for a linkage that is to close to 1e-12.
    """
    dtype = jnp.result_type(*map(jnp.result_type, jax.tree.leaves(params)))
    placed = jax.jit(kinematics)(params, jnp.asarray(crank_angle, dtype))
    legs = {name: np.asarray(value, float) for name, value in placed.pins._asdict().items()}
    a, b, d = np.asarray(placed.hip_pins, float)
    mass = np.asarray(params.mass, float)[LINK_OF_BODY]
    mass[BODIES.index("13")] += float(np.asarray(params.payload))
    return Mechanism(
        crank_angle=float(crank_angle),
        mass=mass,
        inertia=np.asarray(params.inertia, float)[LINK_OF_BODY],
        centre=np.asarray(placed.centres, float),
        pins={**legs, "A": a, "B": b, "D": d},
        slot=(b - a) / np.linalg.norm(b - a),
        total_mass=float(params.total_mass),
        gravity=float(np.asarray(params.gravity)),
        heel=float(np.asarray(params.heel)),
        toe=float(np.asarray(params.toe)),
    )
