"""The UGV in pictures: the frame that is shown, its drawing, and its renderer."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import degrees, hypot
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.drawing import Drawing, GroundContact, Part, Stretch
from stickslip.envs.rendering.numbers import brief, written
from stickslip.envs.rendering.renderer import Quantity, Readout, Renderer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.dynamics.ugv import UGVParams

WEIGHT_LENGTH, CONE_LENGTH = 1.5, 0.62
"""Of the arrow of a force that equals the weight, and of friction cones [m]."""
SPOKES = 5
THICK = 0.06
"""Half the drawn thickness of the body, in its length."""
LEGEND = (
    ("hip-edge", "body"),
    ("mid", "legs"),
    ("motor", "motors"),
    ("holds", "wheel grips: cone of friction, force of the ground"),
    ("slides", "wheel slips"),
)
MOST_POINTS = 1200
"""Of the ground's profile."""


@dataclass(frozen=True)
class WheelFrame:
    """One wheel. centre, contact: points (x, y) [m]. slope: of the ground under it [rad]. turned:
    its angle in the world, anticlockwise [rad]. hinge: of its leg [m]. leg_angle [rad]. friction,
    normal: of the ground on the wheel, along it forwards and out of it [N]. mu: under it [-]."""

    centre: np.ndarray
    contact: np.ndarray
    slope: float
    turned: float
    hinge: np.ndarray
    leg_angle: float
    friction: float
    normal: float
    mu: float


@dataclass(frozen=True)
class UGVFrame:
    """The UGV at one station. Nothing is computed from it but positions.

    x: of the front contact; start: where the drive began [m]. rear, front: the wheels.
    ground: points [n, 2] of the profile about the vehicle, and preview: points [k, 2] of it that
    are observed, without noise [m]. pitch [rad]. torque: on each wheel [N m]. cost: the criterion
    so far. mu: under the wheels, the lesser of them [-]. grip: the lesser margin mu N - |F| [N].
    status: "ok", or what ended the drive. ground_mu: at the points of `ground` [n], None where it
    is the same everywhere.
    """

    x: float
    start: float
    rear: WheelFrame
    front: WheelFrame
    ground: np.ndarray
    preview: np.ndarray
    pitch: float
    torque: float
    cost: float
    mu: float
    grip: float
    status: str = "ok"
    ground_mu: np.ndarray | None = None

    @property
    def demand(self) -> float:
        """The greater |F| / N of both wheels; infinite without a load."""
        return max(
            abs(wheel.friction) / wheel.normal if wheel.normal > 0 else np.inf
            for wheel in (self.rear, self.front)
        )

    @property
    def slips(self) -> bool:
        """Whether a wheel's friction is used up."""
        return self.grip < 0 or self.status == "wheel slip"

    def slipping(self, wheel: WheelFrame) -> bool:
        """Whether it is the wheel with the lesser margin, once the friction is used up."""
        margins = [one.mu * one.normal - abs(one.friction) for one in (self.rear, self.front)]
        own = wheel.mu * wheel.normal - abs(wheel.friction)
        return self.slips and own <= min(margins)


def ugv_drawing(frames: Sequence[UGVFrame], vehicle: UGVParams) -> Drawing:
    """The drawing of one vehicle's drive; frames: one for each sample."""
    length, radius = float(vehicle.body_length), float(vehicle.wheel_radius)
    reach = length + 2 * float(vehicle.leg_length)
    wheels = [[frame.rear for frame in frames], [frame.front for frame in frames]]
    points = np.stack(
        [[getattr(one, name) for one in side] for side in wheels for name in ("hinge", "centre")],
        axis=1,
    )
    pitch = np.array([frame.pitch for frame in frames])
    bodies = [np.column_stack([points[:, 0], pitch])]
    bodies += [
        np.column_stack([points[:, 1 + 2 * i], [one.turned for one in side]])
        for i, side in enumerate(wheels)
    ]
    contacts = tuple(_contact(frames, i, side) for i, side in enumerate(wheels))
    ground, stretches = _ground(frames)
    seen = np.stack([frame.preview for frame in frames])
    words = {"motor": "motors; ground seen ahead"} if seen.shape[1] else {}
    legend = tuple((role, words.get(role, about)) for role, about in LEGEND)
    return Drawing(
        points=points,
        bodies=np.stack(bodies, axis=1),
        parts=_parts(length, radius),
        contacts=contacts,
        ground=ground,
        stretches=stretches,
        focus=(contacts[0].place + contacts[1].place) / 2,
        span=2.4 * reach,
        height=1.1 * reach,
        left=0.45,
        low=0.22 * reach,
        reach=CONE_LENGTH,
        force=WEIGHT_LENGTH,
        weight=float(vehicle.weight),
        seen=seen if seen.shape[1] else None,
        legend=legend,
    )


class UGVRenderer(Renderer[UGVFrame]):
    """Draws frames of one vehicle; the camera goes along with it.

    vehicle: one, not a batch. criterion, unit: of the cost in the header.
    """

    unit = "m"

    def __init__(
        self,
        vehicle: UGVParams,
        criterion: str = "cost",
        unit: str = "-",
        *,
        width: int = 960,
        height: int = 540,
    ):
        super().__init__(width, height)
        if any(np.ndim(value) for value in (vehicle.body_length, vehicle.wheel_radius)):
            raise ValueError("vehicle holds a batch; accepted: one vehicle")
        self._vehicle = vehicle
        self._cost = criterion.replace("_", " ") + ("" if unit == "-" else f"  [{unit}]")

    def drawing(self, frame: UGVFrame) -> Drawing:
        """The drawing of one sample."""
        return ugv_drawing([frame], self._vehicle)

    def readout(self, frame: UGVFrame) -> Readout:
        """Way, torque, pitch, cost and friction; strips of torque, legs and grip."""
        demand = written(frame.demand, 2) if np.isfinite(frame.demand) else "–"
        ended, grip = frame.status != "ok", frame.grip / 1000
        rear, front = degrees(frame.rear.leg_angle), degrees(frame.front.leg_angle)
        torque, aside = brief(frame.torque), "rear, front dashed"
        return Readout(
            numbers=(
                ("driven  [m]", written(frame.x - frame.start, 2)),
                ("torque  [N m]", torque),
                ("pitch  [°]", written(degrees(frame.pitch), 1)),
                (self._cost, brief(frame.cost)),
                ("friction / normal", f"{demand} of {frame.mu:.2f}"),
            ),
            badge=frame.status.upper() if ended else "SLIP" if frame.slips else "GRIP",
            colour=theme.SLIDES if frame.slips else theme.INK if ended else theme.HOLDS,
            at=frame.x,
            quantities=(
                Quantity(
                    "torque on each wheel", "N m", theme.MOTOR, frame.torque, torque, (-50.0, 50.0)
                ),
                Quantity(
                    "legs", "°", theme.HOLDS, rear, written(rear, 0), (60.0, 120.0), front, aside
                ),
                Quantity("margin of grip", "kN", theme.SLIDES, grip, written(grip, 2), (0.0, 1.0)),
            ),
        )


def _parts(length: float, radius: float) -> tuple[Part, ...]:
    """Wheels, body and legs, back to front."""
    turn = np.linspace(0, 2 * np.pi, 49)
    rim = radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    parts = []
    for body in (1, 2):
        parts.append(Part("tyre", outline=rim, body=body))
        parts.append(Part("rim", outline=0.74 * rim, body=body, edge="tyre"))
        for angle in 2 * np.pi / SPOKES * np.arange(SPOKES):
            along = np.array([np.cos(angle), np.sin(angle)])
            across = 0.03 * radius * np.array([-along[1], along[0]])
            end = 0.74 * radius * along
            spoke = np.array([across, end + across, end - across, -across])
            parts.append(Part("mid", outline=spoke, body=body, edge="mid"))
    hinges = np.array([[0.0, 0.0], [length, 0.0]])
    outline = _body_corners(hinges[0], hinges[1], THICK * length)
    parts.append(Part("hip", outline=outline, body=0, edge="hip-edge"))
    width = theme.BAR_WIDTH["main"] + 2.0
    parts += [Part("mid", bars=(pair,), width=width) for pair in ((0, 1), (2, 3))]
    parts.append(Part("hip-edge", dots=(0, 2), width=8.0))
    parts.append(Part("motor", dots=(1, 3), width=8.0))
    return tuple(parts)


def _contact(frames: Sequence[UGVFrame], index: int, wheels: Sequence[WheelFrame]) -> GroundContact:
    def column(name: str) -> np.ndarray:
        return np.array([getattr(one, name) for one in wheels], float)

    normal = column("normal")
    return GroundContact(
        place=np.array([one.contact for one in wheels]),
        slope=column("slope"),
        friction=column("friction"),
        normal=np.where(normal > 0, normal, np.nan),
        mu_static=column("mu"),
        mu_kinetic=column("mu"),
        slips=np.array([frame.slipping((frame.rear, frame.front)[index]) for frame in frames]),
    )


def _ground(frames: Sequence[UGVFrame]) -> tuple[np.ndarray, tuple[Stretch, ...]]:
    """The profile over the whole drive [k, 2] m, and its stretches of one friction."""
    points = np.concatenate([frame.ground for frame in frames])
    given = [frame.ground_mu for frame in frames]
    mu = None if given[0] is None else np.concatenate([one for one in given if one is not None])
    order = np.argsort(points[:, 0], kind="stable")
    kept = order[np.unique(np.linspace(0, len(order) - 1, MOST_POINTS).astype(int))]
    points = points[kept]
    parts = _alike(len(points), None if mu is None else mu[kept], frames[0].mu)
    edges = [points[a, 0] for a, *_ in parts] + [points[-1, 0]]
    stretches = (
        Stretch(float(start), float(end), theme.hexadecimal(theme.floor_colour(mu)), f"μ {mu:.3g}")
        for (start, end), (*_, mu) in zip(pairwise(edges), parts, strict=True)
    )
    return points, tuple(stretches)


def _body_corners(a: np.ndarray, b: np.ndarray, h: float) -> np.ndarray:
    """Outline [5, 2] of the body about the hinges a and b, flattened at the front's upper corner;
    h: half its thickness [m]."""
    along = (b - a) / hypot(*(b - a))
    up = np.array([-along[1], along[0]])
    corners = ((-h, -h), (h, -h), (1.4 * h, 0.2 * h), (-0.2 * h, 1.8 * h), (-h, 1.8 * h))
    ends = (a, b, b, b, a)
    return np.array([end + x * along + y * up for end, (x, y) in zip(ends, corners, strict=True)])


def _alike(count: int, ground_mu: np.ndarray | None, mu: float) -> list[tuple[int, int, float]]:
    """Stretches of the ground's points of one friction: first, one past the last, and mu.

    ground_mu: at each of `count` points, None where it is mu everywhere.
    """
    if ground_mu is None:
        return [(0, count, mu)]
    each = np.round(ground_mu, 3)
    starts = [0, *(np.flatnonzero(np.diff(each)) + 1).tolist()]
    ends = [*(start + 1 for start in starts[1:]), len(each)]  # each reaches the next one
    return [(a, b, float(each[a])) for a, b in zip(starts, ends, strict=True)]
