"""Tracks from files: a table of x and y, or the elevation profile of a GPX track.

Treatments change a survey's points before a track goes through them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.ndimage import grey_dilation, grey_erosion
from scipy.optimize import brentq

from stickslip.dynamics.checks import require_known, require_memory, reraise, shown
from stickslip.dynamics.ugv.ground.surface import Surface
from stickslip.dynamics.ugv.track import Track
from stickslip.optim.columns import ColumnSpec, is_number, read_columns, read_text, shown_path
from stickslip.optim.posture import TREATMENTS
from stickslip.optim.problem import require_scalar

if TYPE_CHECKING:
    from jaxtyping import Bool, Float, Int

EARTH_RADIUS = 6_371_008.8
"""Mean radius [m]."""

MOST_BYTES = 16 * 2**20
"""Greatest size of a file [bytes]; a point takes about 20 in a table and 80 in a GPX track."""
MOST_IN_A_LINE = 10_000
"""Characters of an elevation."""
DEEPEST = 100
"""Elements of a GPX file inside one another."""
BYTES_A_POINT, BYTES_A_KNOT = 400, 600
"""While the spline is made, and for each knot of filled or enveloped ground, about."""
FEWEST = 5
"""Points that a smoothing spline, and the search for outliers, need."""
FINENESS = 32
"""Knots for each radius of an envelope."""
ROUGHLY = 1e-3
"""Relative tolerance of the wavelength at which the residual is the stated noise."""

COLUMNS = (
    ColumnSpec("x", "m", ("distance", "s")),
    ColumnSpec("y", "m", ("elevation", "elev", "height", "z")),
    ColumnSpec("mu", "-", ("friction",), optional=True),
)
LIMITS = {"lat": 90.0, "lon": 360.0, "ele": math.inf}
"""Greatest size of a track point's numbers [deg, m]."""
STEEPEST = 2.0
"""Steeper legs of a GPX track, in m a metre, are a fault of the survey: no vehicle climbs them."""
REPEATED = (
    " (--ground merge, or read_track's merge=0.0, sorts points and merges those at one place)"
)
ACCEPTED_GPX = "a GPX track of 2 or more points that advance, each with lat, lon [deg] and ele [m]"


class Survey(NamedTuple):
    """A track, the points that were read and those that it goes through [n, 2] (x, y) [m]."""

    track: Track
    raw: Float[np.ndarray, "n 2"]
    used: Float[np.ndarray, "m 2"]
    changes: dict[str, float]
    """What the treatments did. Counts: points read, dropped, reordered, merged, gaps filled, knots
    used. Lengths [m]: longest_gap, damped_below (wavelength), largest_change and rms_change of the
    height at the points that were neither dropped nor merged."""


def read_track(path: str | Path, interpolation: str = "cubic", **treatments: Any) -> Track:
    """The track in a file; `interpolation` as in Track.from_points.

    treatments: lengths [m] by the names of `stickslip.optim.posture.TREATMENTS`.

    *.gpx: track points in their order; x is the great-circle distance along them on a sphere of the
    Earth's mean radius (haversine) and y the elevation; document types, and so entities, are
    refused. All else: a table, see `read_columns`; a column `mu` is the friction coefficient along
    the track (`Surface`), untreated. Both in UTF-8, regular files of at most MOST_BYTES. ValueError
    names the file, the line and what is accepted; OSError where it cannot be opened.
    """
    return read_survey(path, interpolation, **treatments).track


def require_track(name: str, known: Iterable[str]) -> None:
    """Raise ValueError for what is neither the known name of a track nor a file."""
    if name not in known and not Path(name).exists():
        accepted = f"{', '.join(known)}, or a file of points (x and y, or GPX)"
        raise ValueError(f"track {name!r} is neither a name nor a file; accepted: {accepted}")


def read_survey(path: str | Path, interpolation: str = "cubic", **treatments: Any) -> Survey:
    """`read_track` with the points that were read, those that are used and what was changed."""
    if not isinstance(path, str | Path) or "\0" in str(path):
        raise ValueError(f"path = {shown(path)}; accepted: the path of a file")
    given, path = checked(treatments), Path(path)
    name, mu = shown_path(path), np.empty((0, 0))
    if path.suffix.lower() == ".gpx":
        places, y = _gpx(path, read_text(path, ACCEPTED_GPX, MOST_BYTES))
    else:
        unordered = REPEATED if "merge" not in given else None
        table = read_columns(path, COLUMNS, most=MOST_BYTES, unordered=unordered)
        places, y, mu = table[:, :1], table[:, 1], table[:, 2:]
    if len(y) < 2:
        raise ValueError(f"{name}: {len(y)} points; accepted: 2 or more")
    require_memory(name, "points", len(y), BYTES_A_POINT)
    raw = np.stack([_along(places), y], axis=1)
    changes: dict[str, float] = {"points": len(y)}
    with reraise(f"{name}: "):
        places, y = _sorted_out(places, y, given, changes)
        used = _reshaped(places, y, given, changes)
        track = Track.from_points(used[:, 0], used[:, 1], interpolation)
        if mu.size:
            track = replace(track, surface=_surface(raw[:, 0], mu[:, 0]))
    return Survey(track, raw, used, changes)


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


def _surface(x: np.ndarray, mu: np.ndarray) -> Surface:
    """Friction coefficients at places in any order; of several at one place, the first."""
    for i in np.flatnonzero(mu < 0)[:1]:
        raise ValueError(f"mu = {mu[i]:.6g} at x = {x[i]:.6g} m; accepted: mu >= 0")
    knots, first = np.unique(x, return_index=True)
    return Surface(knots, mu[first], measured=True).validate()


def _sorted_out(
    places: np.ndarray, y: np.ndarray, given: dict[str, float], changes: dict[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights after `outliers` and `merge`."""
    if "merge" in given and places.shape[1] == 1:
        order = np.argsort(places[:, 0], kind="stable")
        changes["reordered"] = int(np.sum(order != np.arange(len(y))))
        places, y = places[order], y[order]
    if "outliers" in given:
        kept = ~outlying(y, given["outliers"])
        changes["dropped"] = int(np.sum(~kept))
        places, y = places[kept], y[kept]
    if "merge" in given:
        metres = places  # whose distances over a few metres are those on the ground
        if places.shape[1] > 1:
            metres = EARTH_RADIUS * places * np.stack([0 * y + 1, np.cos(places[:, 0])], axis=1)
        first = groups(metres, given["merge"])
        changes["merged"] = len(y) - len(first)
        counts = np.diff(np.append(first, len(y)))
        places = np.add.reduceat(places, first, axis=0) / counts[:, None]
        y = np.add.reduceat(y, first) / counts
    if len(y) < 2:
        raise ValueError(f"{len(y)} points are left; accepted: 2 or more")
    return places, y


def _reshaped(
    places: np.ndarray, y: np.ndarray, given: dict[str, float], changes: dict[str, float]
) -> Float[np.ndarray, "m 2"]:
    """Points of the track after `gaps`, `noise` or `smooth`, and `envelope`."""
    x = _along(places)
    for i in np.flatnonzero(np.diff(x) <= 0)[:1]:
        raise ValueError(
            f"track point {i + 2}: the place of track point {i + 1} again{REPEATED}; accepted: "
            f"{ACCEPTED_GPX}"
        )
    at, height = x, y
    if "gaps" in given:
        gap = np.diff(x)
        changes["filled"] = int(np.sum(gap > given["gaps"]))
        changes["longest_gap"] = float(np.max(gap))
        at, height = filled(x, y, given["gaps"])
    wavelength = given.get("smooth")
    if "noise" in given:
        wavelength = wavelength_of(at, height, given["noise"], np.isin(at, x))
    if wavelength is not None:
        changes["damped_below"] = wavelength
        height = smoothed(at, height, wavelength)
    for i in np.flatnonzero(np.abs(np.diff(height)) > STEEPEST * np.diff(at))[:1]:
        if places.shape[1] > 1:
            raise ValueError(
                f"track point {i + 2}: elevation {height[i + 1]:.6g} m, "
                f"{height[i + 1] - height[i]:+.6g} m in {at[i + 1] - at[i]:.3g} m (--ground "
                "outliers=1 drops such points, noise=0.5 smooths them); accepted: "
                f"{ACCEPTED_GPX}, slopes up to {STEEPEST:g} m a metre"
            )
    if "envelope" in given:
        at, height = enveloped(at, height, given["envelope"])
    off = np.interp(x, at, height) - y
    changes["knots"] = len(at)
    changes["largest_change"] = float(np.max(np.abs(off)))
    changes["rms_change"] = float(np.sqrt(np.mean(off**2)))
    return np.stack([at, height], axis=1)


def _along(places: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n"]:
    """x of a table's places, or the distance along latitudes and longitudes [rad] [m]."""
    if places.shape[1] == 1:
        return places[:, 0]
    latitude, longitude = places.T
    half = np.sin(np.diff(latitude) / 2) ** 2
    half += np.cos(latitude[1:]) * np.cos(latitude[:-1]) * np.sin(np.diff(longitude) / 2) ** 2
    legs = 2 * EARTH_RADIUS * np.arcsin(np.sqrt(np.minimum(half, 1.0)))
    return np.append(0.0, np.cumsum(legs))


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
    if len(x) < FEWEST:
        raise ValueError(f"{len(x)} points; accepted: {FEWEST} or more for noise and smooth")
    return make_smoothing_spline(x, y, np.gradient(x), lam=(wavelength / (2 * np.pi)) ** 4)(x)


def wavelength_of(
    x: Float[np.ndarray, "n"], y: Float[np.ndarray, "n"], noise: float, read: Bool[np.ndarray, "n"]
) -> float:
    """Wavelength [m] with which `smoothed` misses the y that were read by `noise` [m] in root mean
    square, from the mean spacing to the length of the survey, where that stays on one side."""

    def off(log_length: float) -> float:
        residual = (y - smoothed(x, y, math.exp(log_length)))[read]
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
    pieces = math.ceil((x[-1] - x[0]) / radius * FINENESS)
    require_memory(f"envelope = {shown(radius)}", "knots", pieces, BYTES_A_KNOT)
    h, margin = (x[-1] - x[0]) / pieces, 2 * FINENESS + 2
    at = x[0] + h * np.arange(-margin, pieces + margin + 1)
    reach = int(radius / h)
    disc = np.sqrt(np.maximum(radius**2 - (h * np.arange(-reach, reach + 1)) ** 2, 0.0))
    before = y[0] + (at[0] - x[0]) * (y[1] - y[0]) / (x[1] - x[0])  # straight on past the ends
    after = y[-1] + (at[-1] - x[-1]) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    line = np.interp(at, [at[0], *x, at[-1]], [before, *y, after])
    centre = grey_dilation(line, structure=disc)
    nearest = np.rint((x - at[0]) / h).astype(int)
    for k in range(-reach, reach + 1):  # on the points themselves, which lie between the knots
        square = radius**2 - (at[nearest + k] - x) ** 2
        over = y + np.sqrt(np.maximum(square, 0.0))
        np.maximum.at(centre, nearest + k, np.where(square >= 0, over, -np.inf))
    ground = grey_erosion(centre, structure=disc)
    curve = (ground[:-2] + 4 * ground[1:-1] + ground[2:]) / 6
    return at[margin:-margin], curve[margin - 1 : 1 - margin]


def _gpx(path: Path, text: str) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n"]]:
    """Latitude and longitude [rad], without jumps at 180 degrees, and elevation of each point."""
    name, found = shown_path(path), []
    try:
        for point in _Tree().parsed(text).iter("trkpt"):
            found.append((point.get("lat"), point.get("lon"), point.findtext("ele") or None))
            if len(found[-1][2] or "") > MOST_IN_A_LINE:
                raise ValueError(f"track point {len(found)}: a long text in ele")
    except (expat.ExpatError, ValueError) as error:
        why = f"no XML ({error})" if isinstance(error, expat.ExpatError) else error
        raise ValueError(f"{name}: {why}; accepted: {ACCEPTED_GPX}") from None
    values = np.empty((len(found), 3))
    for i, given in enumerate(found):
        place = f"{name}: track point {i + 1}"
        for j, (key, limit) in enumerate(LIMITS.items()):
            text = given[j] or ""
            number = float(text) if is_number(text) else math.nan
            if not (math.isfinite(number) and abs(number) <= limit):
                what = f"{place}: {key} = {shown(given[j])}"
                raise ValueError(f"{what}; accepted: {ACCEPTED_GPX}")
            values[i, j] = number
    return np.unwrap(np.radians(values[:, :2]), axis=0), values[:, 2]


class _Tree(ElementTree.TreeBuilder):
    """Elements of a GPX file by their names without prefix: expat's own parser takes no time to
    look names up, of which a file may declare many."""

    def parsed(self, text: str) -> ElementTree.Element:
        """ExpatError for what is no XML, ValueError for what is not accepted of it."""
        self._depth, parser = 0, expat.ParserCreate("utf-8")
        parser.StartElementHandler, parser.EndElementHandler = self._begin, self._end
        parser.CharacterDataHandler = self.data
        parser.StartDoctypeDeclHandler = self._refuse
        parser.Parse(text.encode(), True)
        return self.close()

    def _begin(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        if self._depth > DEEPEST:
            raise ValueError(f"elements nested deeper than {DEEPEST}")
        self.start(tag.rpartition(":")[2], attributes)

    def _end(self, tag: str) -> None:
        self._depth -= 1
        self.end(tag.rpartition(":")[2])

    def _refuse(self, *_: object) -> None:
        raise ValueError("declares a document type or entities")
