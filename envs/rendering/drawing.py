"""A machine in its place, sample by sample, as arrays: what pictures, films and pages draw."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Part:
    """One shape: exactly one of bars, dots and outline.

    role: its colour, by its name in theme.DAY. bars: pairs of indices of points. dots: indices of
    points. outline: [k, 2] m in the axes of `body`. width: of a bar or a dot, in pixels. group:
    of a leg, None for shapes that are always there, see Drawing.active. edge: role of the edge.
    """

    role: str
    bars: tuple[tuple[int, int], ...] = ()
    dots: tuple[int, ...] = ()
    outline: np.ndarray | None = None
    body: int | None = None
    width: float = 1.0
    group: int | None = None
    edge: str | None = None


@dataclass(frozen=True)
class GroundContact:
    """Force of the ground on one foot or wheel. Every entry [n] but place, [n, 2] m.

    slope: of the ground [rad]. friction, normal: force along and out of the ground [N], NaN without
    contact. mu_static, mu_kinetic: [-], NaN where nothing can slip. slips: whether it slips.
    """

    place: np.ndarray
    slope: np.ndarray
    friction: np.ndarray
    normal: np.ndarray
    mu_static: np.ndarray
    mu_kinetic: np.ndarray
    slips: np.ndarray


@dataclass(frozen=True)
class Stretch:
    """Ground from start to end [m] of one friction. words: its label. icy: drawn with glints."""

    start: float
    end: float
    colour: str
    words: str
    icy: bool = False


@dataclass(frozen=True)
class Drawing:
    """A machine and its ground at n samples.

    points: [n, p, 2] m. bodies: x, y [m] and angle [rad], [n, b, 3]. parts: back to front. active:
    [n], the group of parts in full colours, the other one is pale; None without groups.
    ground: [k, 2] m, its profile. stretches: of it. marks: slides over the ground [m, 4]: the
    sample, from and to [m], and the length of the whole slide [m], NaN until it is over. focus:
    what the camera follows, [n, 2] m, its height only with follow_height. left: place of the focus
    in the picture's width, 0 to 1; low: how far the picture reaches down from it; span, height:
    what it must hold [m]. reach: length of the friction cones, and force: of the arrow of a force
    that equals `weight` [m, N]. seen: points of the ground that are observed, [n, k, 2] m. legend:
    roles with their meaning.
    """

    points: np.ndarray
    bodies: np.ndarray
    parts: tuple[Part, ...]
    contacts: tuple[GroundContact, ...]
    ground: np.ndarray
    stretches: tuple[Stretch, ...]
    focus: np.ndarray
    span: float
    height: float
    left: float
    low: float
    reach: float
    force: float
    weight: float
    marks: np.ndarray | None = None
    active: np.ndarray | None = None
    follow_height: bool = True
    seen: np.ndarray | None = None
    legend: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A motion at n samples as films, pages and `render` show it.

    drawing: of the machine, None without one. numbers: title with unit, values [n] and digits,
    written above it. slips: [n], whether it slips by then. states: names of the two states of
    `slips`, the second one slips. ended: cause of an early end, or "".
    """

    drawing: Drawing | None = None
    numbers: tuple[tuple[str, np.ndarray, int], ...] = ()
    slips: np.ndarray | None = None
    states: tuple[str, str] = ("STICK", "SLIP")
    ended: str = ""
