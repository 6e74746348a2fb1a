"""Pictures of a machine: one sample of a Drawing, painted under the numbers of the moment."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan, ceil, cos, floor, hypot, log10, pi, sin
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stickslip.envs.rendering import theme
from stickslip.envs.rendering.painter import Box, Painter
from stickslip.envs.rendering.theme import nice_step, written

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from stickslip.envs.rendering.drawing import Drawing, GroundContact, Part, Picture, Stretch

BAND = 46.0
"""Height below the machine's ground, for labels."""
ARROW = {"head": 12.0, "barb": 10.0, "shaft": 3.6}
LONGEST = 3.4
"""Longest arrow, in lengths of the weight's."""
GLINTS = 26.0
MARK = 5.0
LABEL_ROOM = 46.0
BADGE_WIDTH = 118.0


class Camera(NamedTuple):
    """From the world [m] to a box of the page."""

    box: Box
    scale: float
    origin: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Points [..., 2] on the page."""
        return self.origin + self.scale * np.asarray(points, float)

    def x(self, place: float) -> float:
        """A place along the ground on the page."""
        return float(self.origin[0] + self.scale * place)

    @property
    def shown(self) -> tuple[float, float]:
        """The stretch of ground in the box [m]."""
        start, end = ((x - self.origin[0]) / self.scale for x in (self.box[0], self.box[2]))
        return float(start), float(end)


def paint_scene(painter: Painter, drawing: Drawing, i: int, box: Box) -> None:
    """Paint sample i into a box, with a scale below it."""
    camera = aimed(drawing, i, box)
    painter.box(box, theme.PANEL)
    with painter.inside(box):
        left, y = box[0] + 12, box[3] - 18
        for role, words in drawing.legend:
            painter.line([(left + 3, y), (left + 17, y)], theme.DAY[role], 5.0)
            painter.text(left + 26, y - 4, words, theme.SMALL, theme.MUTED)
            y -= 17
        for stretch in drawing.stretches:
            _stretch(painter, drawing, stretch, camera)
        _marks(painter, drawing, i, camera)
        for contact in drawing.contacts:
            _cone(painter, contact, i, camera, drawing.reach)
        for part, shade in _ordered(drawing, i):
            _part(painter, drawing, part, shade, i, camera)
        if drawing.seen is not None:
            for place in camera(drawing.seen[i]):
                painter.dot(place, 5.0, theme.PAGE, theme.MOTOR, 1.4)
        for contact in drawing.contacts:
            _force(painter, drawing, contact, i, camera)
    _scale(painter, camera)


def aimed(drawing: Drawing, i: int, box: Box) -> Camera:
    """The camera that keeps the focus at its place."""
    left, bottom, right, top = box
    scale = min((right - left) / drawing.span, (top - bottom - BAND) / drawing.height)
    x, y = (float(each) for each in drawing.focus[i])
    low = (y if drawing.follow_height else 0.0) - drawing.low
    across = left + drawing.left * (right - left) - scale * x
    return Camera(box, scale, np.array([across, bottom + BAND - scale * low]))


def _stretch(painter: Painter, drawing: Drawing, stretch: Stretch, camera: Camera) -> None:
    left, right = camera.shown
    start, end = max(stretch.start, left - 0.1), min(stretch.end, right + 0.1)
    if start >= end:
        return
    x, y = np.asarray(drawing.ground, float).T
    along = np.concatenate([[start], x[(x > start) & (x < end)], [end]])
    profile = camera(np.stack([along, np.interp(along, x, y)], axis=-1))
    bottom = camera.box[1]
    outline = np.concatenate([profile, [[profile[-1, 0], bottom], [profile[0, 0], bottom]]])
    painter.area(outline, stretch.colour)
    if stretch.icy:
        _glints(painter, profile, bottom, camera)
    painter.line(profile, theme.INK, 1.6)
    a, b = max(profile[0, 0], camera.box[0]), min(profile[-1, 0], camera.box[2])
    if b - a > 8 + painter.width_of(stretch.words, theme.LABEL):
        painter.text((a + b) / 2, bottom + 8, stretch.words, align="center")


def _glints(painter: Painter, profile: np.ndarray, bottom: float, camera: Camera) -> None:
    """Paint slanting strokes that stay where they are on the ice."""
    top, offset = float(profile[:, 1].min()), float(camera.origin[0])
    first, last = (floor((profile[k, 0] - offset) / GLINTS) for k in (0, -1))
    for k in range(first, last):
        x = offset + k * GLINTS
        if k % 5 in (0, 1, 3) and x + top - bottom <= profile[-1, 0]:
            painter.line([(x, bottom), (x + top - bottom, top)], (theme.PAGE, 0.5), 2.2, cap="butt")


def _marks(painter: Painter, drawing: Drawing, i: int, camera: Camera) -> None:
    """Paint where the foot slid, with the lengths of the latest slides that have room."""
    if drawing.marks is None:
        return
    left, right = camera.shown
    x, y = np.asarray(drawing.ground, float).T
    taken: list[float] = []
    sample, low, high, _ = drawing.marks.T
    seen = (sample <= i) & (high >= left) & (low <= right)
    for _, low, high, length in drawing.marks[seen][::-1].tolist():
        middle, half = (low + high) / 2, max(high - low, 3 / camera.scale) / 2
        height = float(camera(np.array([0.0, np.interp(middle, x, y)]))[1])
        ends = camera.x(middle - half), camera.x(middle + half)
        below = height - MARK / 2
        painter.line([(end, below) for end in ends], theme.SLIDES, MARK, cap="butt")
        place = camera.x(middle)
        if length >= 5e-4 and all(abs(place - other) > LABEL_ROOM for other in taken):
            taken.append(place)
            words = f"{written(1e3 * length, 0 if length >= 9.95e-3 else 1)} mm"
            painter.text(place, below - 16, words, theme.SMALL, align="center")


def _cone(painter: Painter, contact: GroundContact, i: int, camera: Camera, reach: float) -> None:
    mu, kinetic = float(contact.mu_static[i]), float(contact.mu_kinetic[i])
    if not (np.isfinite(contact.normal[i]) and np.isfinite(mu)):
        return
    colour = theme.SLIDES if contact.slips[i] else theme.HOLDS
    up, half = float(contact.slope[i]) + pi / 2, atan(mu)

    def rim(angle: float) -> np.ndarray:
        return contact.place[i] + reach * np.array([cos(angle), sin(angle)])

    arc = [rim(angle) for angle in np.linspace(up - half, up + half, 17)]
    painter.area(camera(np.array([contact.place[i], *arc])), (colour, 0.16), (colour, 0.75), 0.8)
    if kinetic < mu:
        for side in (-1, 1):
            ends = camera(np.array([contact.place[i], rim(up + side * atan(kinetic))]))
            painter.line(ends, theme.SLIDES, 1.2, dashes=(3.6, 2.9))


def _force(
    painter: Painter, drawing: Drawing, contact: GroundContact, i: int, camera: Camera
) -> None:
    """Paint the force of the ground as an arrow out of it."""
    friction, normal = float(contact.friction[i]), float(contact.normal[i])
    if not np.isfinite(normal):
        return
    colour = theme.SLIDES if contact.slips[i] else theme.HOLDS
    whole = hypot(friction, normal)
    size = min(whole / drawing.weight, LONGEST) if drawing.weight > 0 else 0.0
    length = size * drawing.force * camera.scale
    tail = camera(contact.place[i])
    if length > 0:
        slope = float(contact.slope[i])
        along = np.array([cos(slope), sin(slope)])
        direction = (friction * along + normal * np.array([-along[1], along[0]])) / whole
        neck = length - min(ARROW["head"], length)
        shaft, barb = ARROW["shaft"] / 2, ARROW["barb"] / 2
        ahead = np.array([0, neck, neck, length, neck, neck, 0])
        aside = np.array([-shaft, -shaft, -barb, 0, barb, shaft, shaft])
        outline = np.outer(ahead, direction) + np.outer(aside, [-direction[1], direction[0]])
        painter.area(tail + outline, colour, theme.PAGE, 1.4)
    painter.dot(tail, 6.5, colour, theme.PAGE, 1.2)


def _ordered(drawing: Drawing, i: int) -> Iterator[tuple[Part, str]]:
    """Parts back to front, of neighbours with groups the pale ones first; with their shade."""
    active = None if drawing.active is None else int(drawing.active[i])
    waiting: list[Part] = []
    for part in drawing.parts:
        if part.group is None or part.group == active:
            waiting.append(part)
        else:
            yield part, "pale-"
        if part.group is None:
            yield from ((one, "") for one in waiting)
            waiting = []
    yield from ((one, "") for one in waiting)


def _part(
    painter: Painter, drawing: Drawing, part: Part, shade: str, i: int, camera: Camera
) -> None:
    fill, edge = theme.DAY[shade + part.role], theme.DAY[part.edge or "panel"]
    points = camera(drawing.points[i])
    for pair in part.bars:
        painter.line(points[list(pair)], edge, part.width + 2 * theme.CASING)
        painter.line(points[list(pair)], fill, part.width)
    for index in part.dots:
        painter.dot(points[index], part.width, theme.PAGE, fill, max(1.2, part.width / 4.5))
    if part.outline is not None:
        painter.area(camera(_placed(part, drawing.bodies[i])), fill, edge, 1.2)


def _scale(painter: Painter, camera: Camera) -> None:
    """Paint a scale in metres below the box."""
    left, bottom, right, _ = camera.box
    start, end = camera.shown
    step = nice_step((end - start) / 8)
    digits = max(0, -floor(log10(step) + 1e-9))
    for k in range(ceil(start / step), floor(end / step) + 1):
        x = camera.x(k * step)
        painter.line([(x, bottom), (x, bottom - 5)], theme.MUTED, cap="butt")
        if left + 14 <= x <= right - 14:
            words = f"{written(k * step, digits)} m"
            painter.text(x, bottom - 19, words, theme.SMALL, theme.MUTED, align="center")


def draw_machines(axis: Axes, drawing: Drawing, scale: float) -> None:
    """Draw the machine of every sample on a matplotlib axis in metres; scale: points a pixel."""
    axis.grid(visible=False)
    axis.set_yticks([])
    axis.set_aspect("equal", adjustable="datalim")
    for i, (points, bodies) in enumerate(zip(drawing.points, drawing.bodies, strict=True)):
        for part, shade in _ordered(drawing, i):
            fill, edge = theme.DAY[shade + part.role], theme.DAY[part.edge or "panel"]
            width = scale * part.width
            for pair in part.bars:
                for colour, wide in ((edge, width + 2 * scale * theme.CASING), (fill, width)):
                    look = {"color": colour, "lw": wide, "solid_capstyle": "round"}
                    axis.plot(*points[list(pair)].T, zorder=3, **look)
            for index in part.dots:
                look = {"mfc": theme.PAGE, "mec": fill, "mew": width / 4.5, "ms": width}
                axis.plot(*points[index], "o", zorder=3, **look)
            if part.outline is not None:
                look = {"facecolor": fill, "edgecolor": edge, "lw": 1.2 * scale}
                axis.fill(*_placed(part, bodies).T, zorder=3, **look)


def _placed(part: Part, bodies: np.ndarray) -> np.ndarray:
    """Outline of a part in the world [k, 2] m."""
    x, y, angle = bodies[part.body]
    ahead = np.array([cos(angle), sin(angle)])
    return [x, y] + part.outline @ np.array([ahead, [-ahead[1], ahead[0]]])


def paint(picture: Picture, i: int) -> np.ndarray:
    """Sample i of a picture with a drawing: uint8 [height, width, 3], a fresh array. Needs neither
    a display nor GL, but the extra `viz`."""
    painter, drawing = Painter(), picture.drawing
    if drawing is None:
        raise ValueError("picture without a drawing; accepted: one of a machine")
    left, right, top = theme.MARGIN, theme.WIDTH - theme.MARGIN, theme.HEIGHT - theme.MARGIN
    bottom = top - theme.HEADER
    paint_scene(painter, drawing, i, (left, theme.MARGIN + theme.FOOTER, right, bottom - 10))
    titles = [title for title, _, _ in picture.numbers]
    needed = [painter.width_of(title, theme.SMALL) for title in titles]
    share = (right - left - BADGE_WIDTH - theme.GAP - sum(needed)) / max(len(needed), 1)
    places = left + share * np.arange(len(needed)) + np.cumsum([0, *needed])[:-1]
    for x, (title, values, digits) in zip(places, picture.numbers, strict=True):
        known = np.isfinite(values[i])
        painter.text(x, top - 10, title, theme.SMALL, theme.MUTED)
        words = written(float(values[i]), digits) if known else "–"
        painter.text(x, bottom + 3, words, theme.VALUE, bold=True)
    words, colour = _state(picture, i)
    painter.badge((right - BADGE_WIDTH, bottom + 2, right, top), colour)
    place = right - BADGE_WIDTH / 2, (bottom + top + 2) / 2 - 5
    size = 14.0 if len(words) < 9 else 11.0
    painter.text(*place, words, size, theme.PAGE, bold=True, align="center")
    return painter.picture()


def _state(picture: Picture, i: int) -> tuple[str, str]:
    """The state of sample i in a word, and its colour."""
    if picture.ended and picture.drawing is not None and i == len(picture.drawing.points) - 1:
        return picture.ended.upper(), theme.INK
    slips = picture.slips is not None and bool(picture.slips[i])
    return picture.states[slips], theme.SLIDES if slips else theme.HOLDS
