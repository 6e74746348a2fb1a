"""A walk as the drawing of a page: link by link, from frames."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.biped.contact import CONE_LENGTH, WEIGHT_LENGTH
from stickslip.envs.rendering.biped.floor import FAR, patches_of
from stickslip.envs.rendering.biped.linkage import BARS, SOLE, Mechanism, plain
from stickslip.envs.rendering.biped.trace import LEAST_SLIDE, SlipMarks
from stickslip.envs.rendering.html.colours import hexadecimal
from stickslip.envs.rendering.html.data import Contact, Drawing, Mark, Part, Stretch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.dynamics.biped.params import BipedParams
    from stickslip.dynamics.scene import Scene
    from stickslip.envs.rendering.biped.frame import BipedFrame
    from stickslip.envs.rendering.biped.linkage import Pose

LEGEND = (
    ("main", "supporting leg"),
    ("pale-main", "swinging leg"),
    ("hip-edge", "hip with its slot"),
    ("motor", "crank and motor"),
    ("holds", "foot sticks: cone of friction, force of the ground"),
    ("slides", "foot slips; on the floor: how far"),
)
OWN = ("E", "ankle_bar", "H", "K", "knee_bar", "C", "F", "C_bar", "slot_pin", "rod_pin")


def biped_drawing(
    frames: Sequence[BipedFrame], params: BipedParams, scene: Scene, slips: np.ndarray
) -> tuple[Drawing, np.ndarray]:
    """The drawing of one robot's walk in one scene, and how far the hip has gone [n] m.

    frames: one for each sample, whose weight comes before the robot's; slips: whether the foot
    slips by then [n]. Numbers that are not finite are taken from the frame before.
    """
    whole: list[BipedFrame] = []
    for frame in frames:
        whole.append(frame.finite(whole[-1] if whole else None))
    mechanism = Mechanism(params)
    phases = np.array([frame.phase % (2 * pi) for frame in whole])
    poses = mechanism.poses(phases)
    place = np.array([frame.floor_position for frame in whole])
    leg = np.array([frame.steps % 2 for frame in whole])
    points, names = _points(poses, place, leg)
    surface = -SOLE * mechanism.crank
    hip = points[:, names["A"]]
    tall = mechanism.top - surface
    marks, smears = _marks(whole)
    weight = whole[0].weight
    if weight is None:
        mass = plain(params.total_mass) + (0.0 if scene.payload is None else plain(scene.payload))
        weight = mass * plain(params.gravity)
    drawing = Drawing(
        points=points,
        bodies=_bodies(poses, points, names, leg),
        parts=_parts(mechanism, names),
        contacts=tuple(_contact(whole, leg == side, surface, slips) for side in (0, 1)),
        ground=np.array([[-FAR, surface], [FAR, surface]]),
        stretches=_stretches(scene),
        focus=hip,
        span=0.85 * tall,
        height=1.05 * tall,
        left=0.46,
        low=-surface,
        reach=CONE_LENGTH * tall,
        force=WEIGHT_LENGTH * tall,
        weight=weight,
        marks=marks,
        smears=smears,
        active=leg,
        follow_height=False,
        legend=LEGEND,
    )
    return drawing, hip[:, 0] - mechanism.start


def _points(poses: Pose, place: np.ndarray, leg: np.ndarray) -> tuple[np.ndarray, dict[str, int]]:
    """Pins in the world [n, p, 2], those of each leg apart, and the index of each by its name.

    Poses put the supporting leg first; here a leg keeps its place, so that what lies between two
    samples is between two places of the same pin.
    """
    rows, names, count = [], {}, np.arange(len(leg))
    shift = np.stack([place, np.zeros_like(place)], axis=-1)
    for side in (0, 1):
        which = np.where(leg == side, 0, 1)
        for name in (*OWN, "crank_pin"):
            names[f"{name}{side}"] = len(rows)
            rows.append(poses.pins[name][count, which] + shift)
    for name in "ABD":
        names[name] = len(rows)
        rows.append(poses.pins[name][:, 0] + shift)
    return np.stack(rows, axis=1), names


def _bodies(poses: Pose, points: np.ndarray, names: dict[str, int], leg: np.ndarray) -> np.ndarray:
    """Place and direction of both feet and of the hip [n, 3, 3]."""
    found = []
    for side in (0, 1):
        feet = poses.feet[np.arange(len(leg)), np.where(leg == side, 0, 1)]
        angle = np.arctan2(feet[:, 1], feet[:, 0])
        found.append(np.column_stack([points[:, names[f"E{side}"]], angle]))
    ahead = points[:, names["B"]] - points[:, names["A"]]
    angle = np.arctan2(ahead[:, 1], ahead[:, 0])
    found.append(np.column_stack([points[:, names["A"]], angle]))
    return np.stack(found, axis=1)


def _parts(mechanism: Mechanism, names: dict[str, int]) -> tuple[Part, ...]:
    """Hip, legs, crank and pins, back to front."""
    slot = mechanism.slot
    half = np.array([0.0, 0.12 * mechanism.crank])
    groove = np.array([slot[0] - half, slot[1] - half, slot[1] + half, slot[0] + half])
    parts = [
        Part("hip", outline=mechanism.hip_outline, body=2, edge="hip-edge"),
        Part("page", outline=groove, body=2, edge="hip-edge"),
    ]
    for side in (0, 1):
        parts.append(Part("main", outline=mechanism.sole, body=side, group=side))
        for a, b, role in BARS:
            pair = tuple(names.get(f"{pin}{side}", names.get(pin, -1)) for pin in (a, b))
            width = theme.BAR_WIDTH[role]
            parts.append(Part(role, bars=(pair,), width=width, group=side))  # pyright: ignore[reportArgumentType], two of them
        pins = tuple(names[f"{name}{side}"] for name in OWN)
        parts.append(Part("main", dots=pins, width=4.4, group=side))
    arms = names["crank_pin0"], names["crank_pin1"]
    parts += [
        Part("motor", bars=(arms,), width=6.5),
        Part("motor", dots=(names["A"],), width=13.0),
        Part("motor", dots=arms, width=5.0),
        Part("hip-edge", dots=(names["B"], names["D"]), width=7.0),
    ]
    return tuple(parts)


def _contact(
    frames: Sequence[BipedFrame], own: np.ndarray, surface: float, slips: np.ndarray
) -> Contact:
    """What the ground does to one foot; nothing while the other one carries, or without a load."""

    def column(name: str) -> np.ndarray:
        values = [getattr(frame, name) for frame in frames]
        return np.array([np.nan if value is None else value for value in values], float)

    normal = column("normal_force")
    x = column("floor_position") + column("zmp")
    return Contact(
        place=np.column_stack([x, np.full(len(x), surface)]),
        slope=np.zeros(len(x)),
        friction=column("friction_force"),
        normal=np.where(own & (normal > 0), normal, np.nan),
        mu_static=column("mu_static"),
        mu_kinetic=column("mu_kinetic"),
        slips=slips,
    )


def _stretches(scene: Scene) -> tuple[Stretch, ...]:
    return tuple(
        Stretch(
            max(patch.start, -FAR),
            min(patch.end, FAR),
            hexadecimal(theme.floor_colour(patch.mu_static)),
            patch.label,
            patch.mu_static is not None and patch.mu_static < theme.SLIPPERY,
        )
        for patch in patches_of(scene)
    )


def _marks(frames: Sequence[BipedFrame]) -> tuple[tuple[Mark, ...], np.ndarray]:
    """Slides as wholes, and what was slid over by each sample [n, 2] m."""
    kept, smears = SlipMarks(most=None), np.full((len(frames), 2), np.nan)
    spans: list[list[int]] = []
    for index, frame in enumerate(frames):
        new = kept.record(frame)
        if new is None:
            continue
        smears[index] = new
        if len(kept) > len(spans):
            spans.append([index, index])
        spans[-1][1] = index
    marks = (
        Mark(first, last, low, high)
        for (first, last), (_, low, high) in zip(spans, kept, strict=True)
        if high - low > LEAST_SLIDE
    )
    return tuple(marks), smears
