"""The 24 bodies of the biped as shapes, and where they are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import jax
import numpy as np

from stickslip.dynamics.biped.links import SUPPORT_END, SUPPORT_START, Kinematics, kinematics
from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Part

if TYPE_CHECKING:
    from stickslip.dynamics.biped.params import BipedParams

BARS = (
    ("ankle_bar", "knee_bar", "slim"),  # 11, parallel to the tibia
    ("knee_bar", "C_bar", "slim"),  # 12, parallel to the femur
    ("K", "knee_bar", "slim"),  # 5, knee link
    ("C", "slot_pin", "slim"),  # 10, stabiliser
    ("D", "H", "mid"),  # 4, lower tendon
    ("D", "F", "mid"),  # 6, upper tendon
    ("rod_pin", "B", "mid"),  # 9, rocker
    ("C", "crank_pin", "mid"),  # 7, connecting rod
    ("K", "C", "main"),  # 3, femur
    ("E", "K", "main"),  # 2, tibia
)
"""Each bar of a leg by its end pins, back to front; foot, crank and hip are drawn apart."""
OWN = ("E", "ankle_bar", "H", "K", "knee_bar", "C", "F", "C_bar", "slot_pin", "rod_pin")
"""Pins of one leg."""
NAMES = (*(f"{name}{side}" for side in (0, 1) for name in (*OWN, "crank_pin")), *"ABD")
"""Pins in the order of a drawing's points: those of each leg, and the hip's."""
SOLE = 0.55
"""Thickness of the drawn sole in crank lengths. The model's foot has none: its ankle is on the
ground, so the sole and the floor are drawn below the ankle."""

SWEPT = 33
"""Poses that are computed at once."""

_FEET = [0, 13]  # in BODIES, the supporting leg's first
_sweep = jax.jit(jax.vmap(kinematics, in_axes=(None, 0)))


class Mechanism:
    """The linkage of one robot: its shapes and their places, by the kinematics alone.

    It computes in single precision on the CPU, where one pose takes the least time.
    """

    def __init__(self, params: BipedParams):
        if any(np.ndim(value) for value in (params.crank, params.tibia, params.toe)):
            accepted = "one robot, for instance jax.tree.map(lambda leaf: leaf[0], params)"
            raise ValueError(f"params holds a batch of robots; accepted: {accepted}")
        single = jax.tree.map(lambda leaf: np.asarray(leaf, np.float32), params)
        try:
            self._params = jax.device_put(single, jax.local_devices(backend="cpu")[0])
        except RuntimeError:  # JAX was told to use an accelerator only
            self._params = jax.device_put(single)
        self.crank = float(params.crank)
        swept = self._poses(np.linspace(SUPPORT_START, SUPPORT_END, SWEPT))
        self.top = float(max(np.max(pin[..., 1]) for pin in (*swept.pins, swept.hip_pins)))
        """Highest point any pin reaches over the supporting ankle [m]."""
        self.parts = _parts(params, swept)
        """Hip, legs, crank and pins, back to front."""

    def _poses(self, phases: np.ndarray) -> Kinematics:
        """Kinematics [n] at crank angles of the supporting leg [n, rad], by one compiled sweep."""
        count = -(-len(phases) // SWEPT)
        rows = np.resize(np.asarray(phases, np.float32), (count, SWEPT))
        found = jax.device_get([_sweep(self._params, row) for row in rows])
        return jax.tree.map(lambda *parts: np.concatenate(parts)[: len(phases)], *found)

    def placed(
        self, phases: np.ndarray, place: np.ndarray, leg: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Pins in the world [n, p, 2] m as in NAMES, and x, y, angle of feet and hip [n, 3, 3].

        phases: crank angles of the supporting leg [n, rad]; place: of its ankle [n, m]; leg: which
        it is [n]. Kinematics put the supporting leg first; here a leg keeps its place, so that what
        lies between two samples is between two places of the same pin.
        """
        now, count = self._poses(phases), np.arange(len(leg))
        pins = now.pins._asdict()
        sides = [np.where(leg == side, 0, 1) for side in (0, 1)]
        rows = [pins[name][count, side] for side in sides for name in (*OWN, "crank_pin")]
        rows += [now.hip_pins[:, k] for k in range(3)]
        points = np.stack(rows, axis=1) + np.stack([place, np.zeros_like(place)], -1)[:, None]
        feet = [np.angle(np.exp(1j * now.angles[count, np.take(_FEET, side)])) for side in sides]
        A, B = points[:, NAMES.index("A")], points[:, NAMES.index("B")]
        angles = [*feet, np.arctan2(*(B - A).T[::-1])]
        origins = [points[:, NAMES.index(name)] for name in ("E0", "E1", "A")]
        placed = [np.column_stack(both) for both in zip(origins, angles, strict=True)]
        return points, np.stack(placed, axis=1)


def _parts(params: BipedParams, swept: Kinematics) -> tuple[Part, ...]:
    """Shapes of one robot; swept: its poses in a step."""
    crank = float(params.crank)
    slot = _slot(params, swept)
    base, drop = float(params.ground_link), float(params.tendon_drop)
    hip = _hull(np.array([[0, 0], [base, 0], [base, -drop], *slot]), 0.55 * crank)
    half = np.array([0.0, 0.12 * crank])
    groove = np.array([slot[0] - half, slot[1] - half, slot[1] + half, slot[0] + half])
    parts = [
        Part("hip", outline=hip, body=2, edge="hip-edge"),
        Part("page", outline=groove, body=2, edge="hip-edge"),
    ]
    sole = _sole(params)
    for side in (0, 1):
        parts.append(Part("main", outline=sole, body=side, group=side))
        for a, b, role in BARS:
            ends, width = (_pin(a, side), _pin(b, side)), theme.BAR_WIDTH[role]
            parts.append(Part(role, bars=(ends,), width=width, group=side))
        dots = tuple(_pin(name, side) for name in OWN)
        parts.append(Part("main", dots=dots, width=4.4, group=side))
    arms = _pin("crank_pin", 0), _pin("crank_pin", 1)
    return (
        *parts,
        Part("motor", bars=(arms,), width=6.5),
        Part("motor", dots=(_pin("A"),), width=13.0),
        Part("motor", dots=arms, width=5.0),
        Part("hip-edge", dots=(_pin("B"), _pin("D")), width=7.0),
    )


def _pin(name: str, side: int = 0) -> int:
    """Index of a pin of a leg, or of the hip."""
    return NAMES.index(name if name in NAMES else f"{name}{side}")


def _slot(params: BipedParams, swept: Kinematics) -> np.ndarray:
    """Between which points the slot's pins travel, from A, in the hip's axes [2, 2] m."""
    from_A = swept.pins.slot_pin - swept.hip_pins[:, None, 0]
    ahead = swept.hip_pins[:, 1] - swept.hip_pins[:, 0]
    ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
    along = np.sum(from_A * ahead[:, None], axis=-1)
    depth = float(params.slot_depth)
    return np.array([[along.min(), -depth], [along.max(), -depth]])


def _sole(params: BipedParams) -> np.ndarray:
    """Outline of the foot about its ankle, along it and upwards [n, 2] m: upright edges at heel and
    toe, and a bracket about the two pins."""
    crank, heel, toe = float(params.crank), float(params.heel), float(params.toe)
    bottom, edge, top = -SOLE * crank, -0.1 * SOLE * crank, 0.3 * crank
    rear, front = -min(0.8 * crank, heel), min(float(params.offset) + 0.8 * crank, toe)
    slope = 0.6 * crank
    last, first = max(rear - slope, -heel), min(front + slope, toe)
    along = np.array([-heel, toe, toe, first, front, rear, last, -heel])
    up = np.array([bottom, bottom, edge, edge, top, top, edge, edge])
    return np.stack([along, up], axis=-1)


def _hull(points: np.ndarray, reach: float, corners: int = 48) -> np.ndarray:
    """Hull of discs of radius `reach` about points [n, 2], by support points in even directions."""
    turn = np.arange(corners) * (2 * np.pi / corners)
    out = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return points[np.argmax(points @ out.T, axis=0)] + reach * out
