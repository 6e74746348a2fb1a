"""Named treatments of a survey's points, before a track goes through them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from stickslip.dynamics.checks import require_known, require_memory, shown
from stickslip.optim.posture import TREATMENTS
from stickslip.optim.problem import require_scalar

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

    from stickslip.dynamics.ugv.track import Track

FEWEST = 5
"""Points that a smoothing spline, and the search for outliers, need."""
FINENESS = 32
"""Knots for each radius of an envelope."""
BYTES_A_KNOT = 600
"""Memory for each knot of filled or enveloped ground, about [bytes]."""
ROUGHLY = 1e-3
"""Relative tolerance of the wavelength at which the residual is the stated noise."""


class Survey(NamedTuple):
    """A track, the points that were read and those that it goes through [n, 2] (x, y) [m]."""

    track: Track
    raw: Float[np.ndarray, "n 2"]
    used: Float[np.ndarray, "m 2"]
    changes: dict[str, float]
    """What the treatments did. Counts: points read, dropped, reordered, merged, gaps filled, knots
    used. Lengths [m]: longest_gap, damped_below (wavelength), largest_change and rms_change of the
    height at the points that were neither dropped nor merged."""


def checked(given: dict[str, Any]) -> dict[str, float]:
    """The treatments [m] that are not None. ValueError for unknown names, numbers that are no such
    lengths, and noise with smooth."""
    require_known(given, TREATMENTS, "treatment of a track")
    found = {name: value for name, value in given.items() if value is not None}
    for name, value in found.items():
        strict = name != "merge"
        accepted = f"a length {'>' if strict else '>='} 0 [m]"
        require_scalar(name, value, low=0.0, strict=strict, accepted=accepted)
    if {"noise", "smooth"} <= found.keys():
        raise ValueError(
            f"noise = {found['noise']} and smooth = {found['smooth']}; accepted: one of them"
        )
    return found


def outlying(y: Float[np.ndarray, "n"], limit: float) -> Bool[np.ndarray, "n"]:
    """True where y is further than `limit` from the median of the two neighbours on each side.

    The ends are continued by point reflection, so that slopes are no outliers, nor is an end.
    """
    if len(y) < FEWEST:
        raise ValueError(f"{len(y)} points; accepted: {FEWEST} or more for outliers")
    beyond = np.pad(y, 2, mode="reflect", reflect_type="odd")
    about = np.stack([beyond[k : len(y) + k] for k in (0, 1, 3, 4)])
    return np.abs(y - np.median(about, axis=0)) > limit


def groups(places: Float[np.ndarray, "n d"], length: float) -> Int[np.ndarray, "groups"]:
    """Index of the first point of each group: the points after it within `length` [m] of it."""
    first, found = None, []
    for i, place in enumerate(places.tolist()):
        if first is None or math.dist(first, place) > length:
            first = place
            found.append(i)
    return np.array(found, dtype=int)


def filled(
    x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], longest: float
) -> tuple[np.ndarray, np.ndarray]:
    """The points, and on straight lines across longer gaps more of them, spaced as the median."""
    gap = np.diff(x)
    pieces = np.where(gap > longest, np.ceil(gap / min(float(np.median(gap)), longest)), 1)
    require_memory(f"gaps = {longest}", "points", float(np.sum(pieces)), BYTES_A_KNOT)
    pieces = pieces.astype(int)
    left = np.repeat(np.arange(len(gap)), pieces)
    share = np.arange(len(left)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    share = share / pieces[left]
    inner = (of[left] + share * np.diff(of)[left] for of in (x, y))
    whole = [np.append(of, end) for of, end in zip(inner, (x[-1], y[-1]), strict=True)]
    return whole[0], whole[1]


def smoothed(
    x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], wavelength: float
) -> Float[np.ndarray, "n"]:
    """Heights of the smoothing spline that halves waves of that length [m] and damps shorter ones.

    SciPy minimises sum w (y - f)^2 + c int f''^2. With each point's share of x as its weight w, a
    wave of angular frequency k is multiplied by 1 / (1 + c k^4).
    """
    from scipy.interpolate import make_smoothing_spline

    if len(x) < FEWEST:
        raise ValueError(f"{len(x)} points; accepted: {FEWEST} or more for noise and smooth")
    lam = (wavelength / (2 * np.pi)) ** 4
    return make_smoothing_spline(x, y, np.gradient(x), lam=lam)(x)


def wavelength_of(x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], noise: float) -> float:
    """Wavelength [m] with which `smoothed` misses y by `noise` [m] in root mean square.

    From the points' mean spacing to the length of the survey, where the residual stays on one side.
    """
    from scipy.optimize import brentq

    def off(log_length: float) -> float:
        residual = y - smoothed(x, y, math.exp(log_length))
        return math.sqrt(float(np.mean(residual**2))) - noise

    low, high = math.log((x[-1] - x[0]) / (len(x) - 1)), math.log(x[-1] - x[0])
    if off(low) >= 0 or off(high) <= 0:
        return math.exp(low if off(low) >= 0 else high)
    return math.exp(brentq(off, low, high, rtol=ROUGHLY))  # pyright: ignore


def enveloped(
    x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """The ground that a disc feels: the polyline, its hollows filled up to the disc, at even x.

    The disc's centre runs along the greyscale dilation of the polyline by the disc; the erosion of
    that path is the ground (a closing). Knots are `radius` / FINENESS apart. The heights there are
    coefficients of a uniform cubic B-spline, so that no second derivative exceeds that of the
    closing. Its values at the knots are returned; a natural spline through them is the same curve.
    """
    from scipy.ndimage import grey_dilation, grey_erosion

    pieces = math.ceil((x[-1] - x[0]) / radius * FINENESS)
    require_memory(f"envelope = {shown(radius)}", "knots", pieces, BYTES_A_KNOT)
    h, margin = (x[-1] - x[0]) / pieces, 2 * FINENESS + 2
    at = x[0] + h * np.arange(-margin, pieces + margin + 1)
    reach = int(radius / h)
    disc = np.sqrt(np.maximum(radius**2 - (h * np.arange(-reach, reach + 1)) ** 2, 0.0))
    centre = grey_dilation(_straight_on(x, y, at), structure=disc)
    nearest = np.rint((x - at[0]) / h).astype(int)
    for k in range(-reach, reach + 1):  # on the points themselves, which lie between the knots
        square = radius**2 - (at[nearest + k] - x) ** 2
        over = y + np.sqrt(np.maximum(square, 0.0))
        np.maximum.at(centre, nearest + k, np.where(square >= 0, over, -np.inf))
    ground = grey_erosion(centre, structure=disc)
    curve = (ground[:-2] + 4 * ground[1:-1] + ground[2:]) / 6
    return at[margin:-margin], curve[margin - 1 : 1 - margin]


def _straight_on(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Heights of the polyline at `at`, straight on past its ends."""
    before = y[0] + (at[0] - x[0]) * (y[1] - y[0]) / (x[1] - x[0])
    after = y[-1] + (at[-1] - x[-1]) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.interp(at, [at[0], *x, at[-1]], [before, *y, after])
