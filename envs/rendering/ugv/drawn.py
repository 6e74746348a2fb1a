"""A drive as the drawing of a page, from frames."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.html.colours import hexadecimal
from stickslip.envs.rendering.html.data import Contact, Drawing, Part, Stretch
from stickslip.envs.rendering.ugv.ground import alike
from stickslip.envs.rendering.ugv.vehicle import (
    CONE_LENGTH,
    SPOKES,
    THICK,
    WEIGHT_LENGTH,
    body_corners,
    slipping,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from stickslip.dynamics.ugv import UGVParams
    from stickslip.envs.rendering.ugv.frame import UGVFrame, WheelFrame

LEGEND = (
    ("hip-edge", "body"),
    ("mid", "legs"),
    ("motor", "motors"),
    ("holds", "wheel grips: cone of friction, force of the ground"),
    ("slides", "wheel slips"),
)
MOST_POINTS = 1200
"""Of the ground's profile in a page."""


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
        span=1.9 * reach,
        height=1.0 * reach,
        left=0.45,
        low=0.22 * reach,
        reach=CONE_LENGTH,
        force=WEIGHT_LENGTH,
        weight=float(vehicle.weight),
        seen=seen if seen.shape[1] else None,
        legend=legend,
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
    outline = body_corners(hinges[0], hinges[1], THICK * length)
    parts.append(Part("hip", outline=outline, body=0, edge="hip-edge"))
    width = theme.BAR_WIDTH["main"] + 2.0
    parts += [Part("mid", bars=(pair,), width=width) for pair in ((0, 1), (2, 3))]
    parts.append(Part("hip-edge", dots=(0, 2), width=8.0))
    parts.append(Part("motor", dots=(1, 3), width=8.0))
    return tuple(parts)


def _contact(frames: Sequence[UGVFrame], index: int, wheels: Sequence[WheelFrame]) -> Contact:
    def column(name: str) -> np.ndarray:
        return np.array([getattr(one, name) for one in wheels], float)

    normal = column("normal")
    return Contact(
        place=np.array([one.contact for one in wheels]),
        slope=column("slope"),
        friction=column("friction"),
        normal=np.where(normal > 0, normal, np.nan),
        mu_static=column("mu"),
        mu_kinetic=column("mu"),
        slips=np.array([slipping(frame, (frame.rear, frame.front)[index]) for frame in frames]),
    )


def _ground(frames: Sequence[UGVFrame]) -> tuple[np.ndarray, tuple[Stretch, ...]]:
    """The profile over the whole drive [k, 2] m, and its stretches of one friction."""
    points = np.concatenate([frame.ground for frame in frames])
    given = [frame.ground_mu for frame in frames]
    mu = None if given[0] is None else np.concatenate([one for one in given if one is not None])
    order = np.argsort(points[:, 0], kind="stable")
    kept = order[np.unique(np.linspace(0, len(order) - 1, MOST_POINTS).astype(int))]
    points = points[kept]
    parts = alike(len(points), None if mu is None else mu[kept], frames[0].mu)
    edges = [points[a, 0] for a, *_ in parts] + [points[-1, 0]]
    stretches = (
        Stretch(float(start), float(end), hexadecimal(theme.floor_colour(one)), f"μ {one:.3g}")
        for (start, end), (*_, one) in zip(pairwise(edges), parts, strict=True)
    )
    return points, tuple(stretches)
