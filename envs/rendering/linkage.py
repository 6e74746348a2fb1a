"""The 24 bodies, drawn link by link."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import jax
import numpy as np

from stickslip.dynamics.biped.links import (
    SUPPORT_END,
    SUPPORT_START,
    Kinematics,
    kinematics,
)

if TYPE_CHECKING:
    from jax.typing import ArrayLike

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

SOLE = 0.55
"""Thickness of the drawn sole in crank lengths. The model's foot has none: its ankle is on the
ground, so the sole and the floor are drawn below the ankle."""

_FOOT_OF_LEG = (0, 13)  # in BODIES
_sweep = jax.jit(jax.vmap(kinematics, in_axes=(None, 0)))


class Pose(NamedTuple):
    """Positions of the links in the ground frame of the supporting ankle, as NumPy arrays."""

    pins: dict[str, np.ndarray]
    """Each [2 legs, 2] m, supporting leg first; A, B and D are the hip's, the same for both."""
    feet: np.ndarray
    """Directions of both feet [2 legs, 2], heel to toe."""


def _on_cpu(params: BipedParams) -> BipedParams:
    """Parameters in single precision on the CPU, where one pose is computed quickest."""
    single = jax.tree.map(lambda leaf: np.asarray(leaf, np.float32), params)
    try:
        return jax.device_put(single, jax.local_devices(backend="cpu")[0])
    except RuntimeError:  # JAX was told to use an accelerator only
        return jax.device_put(single)


def plain(number: ArrayLike) -> float:
    """A single number, of JAX or not, as Python's own."""
    return np.asarray(number, float).item()


class Mechanism:
    """The linkage of one robot: poses and extents, by the kinematics alone (on the CPU)."""

    def __init__(self, params: BipedParams):
        if any(np.ndim(value) for value in (params.crank, params.tibia, params.toe)):
            raise ValueError(
                "params holds a batch of robots; accepted: one robot, for instance "
                "jax.tree.map(lambda leaf: leaf[0], params)"
            )
        self._params = _on_cpu(params)
        self.crank, self.offset = plain(params.crank), plain(params.offset)
        self.heel, self.toe = plain(params.heel), plain(params.toe)
        self.sole = _sole(self)
        """The drawn foot about its ankle, along it and upwards [n, 2] m."""
        phases = np.linspace(SUPPORT_START, SUPPORT_END, 33, dtype=np.float32)
        swept = jax.tree.map(np.asarray, _sweep(self._params, phases))
        pins = np.stack([*swept.pins])
        self.top = float(max(pins[..., 1].max(), swept.hip_pins[..., 1].max()))
        """Highest point any pin reaches over the supporting ankle [m]."""
        from_A = swept.pins.slot_pin - swept.hip_pins[:, None, 0]
        ahead = swept.hip_pins[:, 1] - swept.hip_pins[:, 0]
        ahead /= np.linalg.norm(ahead, axis=-1, keepdims=True)
        along = np.sum(from_A * ahead[:, None], axis=-1)
        depth, base = plain(params.slot_depth), plain(params.ground_link)
        self.slot = np.array([[along.min(), -depth], [along.max(), -depth]])
        """Between which points the slot's pins travel, from A, in the hip's axes [2, 2] m."""
        joints = np.array([[0, 0], [base, 0], [base, -plain(params.tendon_drop)], *self.slot])
        self.hip_outline = _hull(joints, 0.55 * self.crank)
        """The drawn hip about A, B, D and the slot, from A, in the hip's axes [n, 2] m."""
        self.start = float(swept.hip_pins[0, 0, 0])
        """The hip's A at the start of a step, before the supporting ankle [m]."""

    def poses(self, phases: np.ndarray) -> Pose:
        """The links at crank angles of the supporting leg [n, rad]; n leads in every array."""
        return _pose(jax.device_get(_sweep(self._params, np.asarray(phases, np.float32))))


def _pose(now: Kinematics) -> Pose:
    pins = now.pins._asdict()
    for index, name in enumerate("ABD"):
        place = now.hip_pins[..., index, :]
        pins[name] = np.stack([place, place], axis=-2)
    angles = now.angles[..., list(_FOOT_OF_LEG)]
    return Pose(pins, np.stack([np.cos(angles), np.sin(angles)], axis=-1))


def _sole(m: Mechanism) -> np.ndarray:
    """Outline of the foot: upright edges at heel and toe, and a bracket about the two pins."""
    bottom, edge, top = -SOLE * m.crank, -0.1 * SOLE * m.crank, 0.3 * m.crank
    rear, front = -min(0.8 * m.crank, m.heel), min(m.offset + 0.8 * m.crank, m.toe)
    slope = 0.6 * m.crank
    last, first = max(rear - slope, -m.heel), min(front + slope, m.toe)
    along = np.array([-m.heel, m.toe, m.toe, first, front, rear, last, -m.heel])
    up = np.array([bottom, bottom, edge, edge, top, top, edge, edge])
    return np.stack([along, up], axis=-1)


def _hull(points: np.ndarray, reach: float, corners: int = 48) -> np.ndarray:
    """Outline of the convex hull of discs of radius `reach` about the points [n, 2], by its support
    points in even directions."""
    turn = np.arange(corners) * (2 * np.pi / corners)
    out = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    return points[np.argmax(points @ out.T, axis=0)] + reach * out
